; Two robots carry crates between the zones of a warehouse.
(define (domain delivery)
  (:requirements :strips :typing :negative-preconditions)
  (:types robot zone crate)
  (:predicates
    (connected ?from ?to - zone)
    (robot_at ?r - robot ?z - zone)
    (crate_at ?c - crate ?z - zone)
    (carries ?r - robot ?c - crate)
    (loaded ?r - robot))
  (:action move
    :parameters (?r - robot ?from ?to - zone)
    :precondition (and (robot_at ?r ?from) (connected ?from ?to))
    :effect (and (not (robot_at ?r ?from)) (robot_at ?r ?to)))
  (:action pick
    :parameters (?r - robot ?c - crate ?z - zone)
    :precondition (and (robot_at ?r ?z) (crate_at ?c ?z) (not (loaded ?r)))
    :effect (and (loaded ?r) (carries ?r ?c) (not (crate_at ?c ?z))))
  (:action place
    :parameters (?r - robot ?c - crate ?z - zone)
    :precondition (and (robot_at ?r ?z) (carries ?r ?c))
    :effect (and (not (loaded ?r)) (not (carries ?r ?c)) (crate_at ?c ?z))))
