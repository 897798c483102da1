; Actions read after their start what they changed then.
(define (domain depot)
  (:requirements :typing :durative-actions :adl :numeric-fluents)
  (:types robot crate - thing thing zone - object)
  (:constants dock - zone)
  (:predicates
    (at ?t - thing ?z - zone)
    (on ?c - crate ?r - robot)
    (free ?r - robot))
  (:functions (battery ?r - robot) (distance ?from ?to - zone) (moves))
  (:durative-action move
    :parameters (?r - robot ?from ?to - zone)
    :duration (= ?duration 5)
    :condition (and (at start (at ?r ?from)) (over all (free ?r)) (over all (not (at ?r ?to)))
      (at start (<= moves 3)) (at end (>= moves 1)))
    :effect (and (at start (not (free ?r))) (at end (free ?r)) (at start (not (at ?r ?from))) (at end (at ?r ?to))
      (at start (increase (moves) 1)) (at end (assign (battery ?r) moves))))
  (:durative-action lend
    :parameters (?r ?s - robot ?z - zone)
    :duration (= ?duration 5)
    :condition (and (over all (free ?s)) (over all (forall (?r - robot) (at ?r ?z))) (at end (not (at ?r dock))))
    :effect (and (at start (free ?r)) (at start (not (at ?s ?z))) (at start (at ?s ?z))))
  (:action load
    :parameters (?r - robot ?c - crate ?z - zone)
    :precondition (and (at ?r ?z) (at ?c ?z) (free ?r))
    :effect (and (on ?c ?r) (not (free ?r)) (not (at ?c ?z)) (forall (?s - robot) (decrease (battery ?r) 1)))))
