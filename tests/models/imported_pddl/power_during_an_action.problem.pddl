(define (problem w) (:domain power) (:objects a b - machine) (:init (= (power) 3) (= (wear a) 0) (= (wear b) 0)) (:goal (and (done a) (done b))))
