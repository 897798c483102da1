(define (problem w) (:domain transfer) (:objects a b - tank) (:init (= (level a) 5) (= (level b) 0)) (:goal (= (level a) 7)))
