; Robots carry crates between zones, and their batteries run empty.
(define (domain depot)
  (:requirements :typing :adl :numeric-fluents)
  (:types
    robot crate - thing
    thing zone - object)
  (:constants dock - zone)
  (:predicates
    (at ?t - thing ?z - zone)
    (on ?c - crate ?r - robot)
    (free ?r - robot))
  (:functions (battery ?r - robot) (distance ?from ?to - zone))
  (:durative-action move
    :parameters (?r - robot ?from ?to - zone)
    :duration (>= ?duration 5)
    :condition (and (at start (at ?r ?from)) (free ?r) (over end (free ?r)))
    :effect (and (at start (not (at ?r ?from))) (at ?r ?to) (at end (decrease (battery ?r) ?duration))))
  (:durative-action charge :parameters (?r - robot)
    :duration (= ?time 3) :effect (at end (assign (battery ?r) 10)))
  (:durative-action rest :parameters (?r - robot)
    :effect (at end (free ?r)))
  (:action load
    :parameters (?r - robot ?c - crate ?z - zone)
    :precondition (and (at ?r ?z) (at ?c ?z) (free ?r))
    :effect (and (on ?c ?r) (not (free ?r)) (not (at ?c ?z)))))
