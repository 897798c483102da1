; A clamp is held, and needs power, only while `hold` executes.
(define (domain welding)
  (:requirements :typing :durative-actions :adl :fluents)
  (:types clamp seam)
  (:predicates (held ?c - clamp) (spare ?c - clamp) (welded ?s - seam) (at_clamp ?s - seam ?c - clamp))
  (:functions (power))
  (:durative-action hold
    :parameters (?c - clamp)
    :duration (= ?duration 8)
    :condition (and (at start (spare ?c)) (at start (>= (power) 2)))
    :effect (and (at start (not (spare ?c))) (at start (held ?c)) (at start (decrease (power) 2))
      (at end (not (held ?c))) (at end (spare ?c)) (at end (increase (power) 2))))
  (:durative-action weld
    :parameters (?s - seam ?c - clamp)
    :duration (= ?duration 3)
    :condition (and (over all (held ?c)) (at start (at_clamp ?s ?c)))
    :effect (at end (welded ?s)))
  (:action inspect
    :parameters (?s - seam)
    :precondition (exists (?c - clamp) (and (at_clamp ?s ?c) (not (spare ?c))))
    :effect (forall (?c - clamp) (when (held ?c) (welded ?s))))
  (:action save
    :parameters (?s - seam)
    :precondition (<= (power) 1)
    :effect (welded ?s))
  (:action finish
    :parameters (?s - seam ?c - clamp)
    :precondition (and (spare ?c) (>= (power) 1) (not (held ?c)))
    :effect (welded ?s)))
