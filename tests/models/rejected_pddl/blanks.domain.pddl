; Robots carry crates between zones.
(define (domain depot)
  (:requirements :typing)
  (:types robot crate -thing zone)
  (:predicates (at ?t -thing ?z - zone) (on ?c - crate ?r- robot))
  (:action load
    :parameters (?r -robot ?c - crate ?z - zone)
    :precondition (and (at?r?z) (at ?c ?z))
    :effect (and (on ?c ?r) (not (at ?c ?z)))))
