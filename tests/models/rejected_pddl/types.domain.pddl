; Robots carry crates between zones, and their batteries run empty.
(define (domain depot)
  (:requirements :typing :adl :numeric-fluents)
  (:types
    robot crate crate - thng
    thing - zone zone - thing 3d)
  (:constants dock - zone)
  (:predicates
    (at ?t - thing ?z - zone)
    (on ?c - crate ?r - robot)
    (free ?r - robot))
  (:functions (battery ?r - robot) (distance ?from ?to - zone))
  (:action move
    :parameters (?r - robot ?from ?to - zone)
    :precondition (and (at ?r ?from) (>= (battery ?r) (distance ?from ?to)) (>= (battery ?r) 1))
    :effect (and (not (at ?r ?from)) (at ?r ?to) (decrease (battery ?r) 1)))
  (:action load
    :parameters (?r - robot ?c - crate ?z - zone)
    :precondition (and (at ?r ?z) (at ?c ?z) (free ?r))
    :effect (and (on ?c ?r) (not (free ?r)) (not (at ?c ?z)))))
