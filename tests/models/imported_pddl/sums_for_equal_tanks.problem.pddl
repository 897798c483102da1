(define (problem w) (:domain transfer) (:objects a b - tank) (:init (= (level a) 3) (= (level b) 0)) (:goal (and (= (level a) 4) (= (level b) 1))))
