(define (problem one-crate)
  (:objects r1 - robot c1 - crate shelf - zone)
  (:goal (on c1 r1) (free r1)))
