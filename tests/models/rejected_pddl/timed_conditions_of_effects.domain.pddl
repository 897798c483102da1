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
    :duration (= ?duration 5)
    :condition (at start (free ?r))
    :effect (and (at start (not (free ?r))) (when (at end (free ?r)) (at start (at ?r ?from)))
      (when (at end (free ?r)) (at end (at ?r ?to)))))
  (:action load
    :parameters (?r - robot ?c - crate ?z - zone)
    :precondition (and (at ?r ?z) (at ?c ?z) (free ?r))
    :effect (and (on ?c ?r) (not (free ?r)) (not (at ?c ?z)))))
