; Robots carry crates between zones, and their batteries run empty.
(define (domain depot)
  (:requirements :typing :numeric-fluents :durative-actions)
  (:types robot crate - thing zone)
  (:constants dock - zone)
  (:predicates (at ?t - thing ?z - zone) (on ?c - crate ?r - robot) (free ?r - robot))
  (:functions (battery ?r - robot) (distance ?from ?to - zone))
  (:durative-action move
    :parameters (?r - robot ?from ?to - zone)
    :duration (= ?duration (- (distance ?from ?to) 7.123456789))
    :condition (and (at start (at ?r ?from)) (at start (>= (battery ?r) 1.2345678901)))
    :effect (and (at start (not (at ?r ?from))) (at end (at ?r ?to)) (at end (decrease (battery ?r) 0.50))))
  (:action load
    :parameters (?r - robot ?c - crate ?z - zone)
    :precondition (and (at ?r ?z) (at ?c ?z) (free ?r) (>= (battery ?r) (/ 1 3)) (<= (battery ?r) (+ 1234567.5 1)))
    :effect (and (on ?c ?r) (not (free ?r)) (not (at ?c ?z)))))
