(define (problem w1) (:domain welding)
  (:objects c1 - clamp s1 - seam)
  (:init (spare c1) (at_clamp s1 c1) (= (power) 3))
  (:goal (and (welded s1) (held c1))))
