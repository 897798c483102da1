(define (problem p) (:domain two) (:objects t1 t2 - truck c1 - crate a b - zone v1 - vehicle)
 (:init (drivable t1) (at t1 a) (at t2 a) (at c1 b) (road a b) (road b a) (heavy t2)) (:goal (and (at c1 a) (at t2 b))))
