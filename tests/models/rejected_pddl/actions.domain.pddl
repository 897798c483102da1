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
  (:action move
    :parameters (?r - robot ?from ?to - zone)
    :condition (and (at ?r ?from) (>= (battery ?r) (distance ?from ?to)) (>= (battery ?r) 1))
    :effect (and (not (at ?r ?from)) (at ?r ?to) (decrease (battery ?r) 1)))
  (:action move
    :parameters (r - robot ?c ?c - crate ?z - zon)
    :precondition (and (at ?r ?z) (at ?c ?z) (free ?r))
    :effect (and (on ?c ?r) (not (free ?r)) (not (at ?c ?z))))
  (:action wait :parameters (?r - robot) :precondition (free ?r))
  (:action idle :parameters () :effect (and))
  (:action :parameters () :effect (free dock))
  (:action stop :effect (free r1) :effect)
  (:action look :parameters (?r - robot) :observe (free ?r) :effects (free ?r) extra))
