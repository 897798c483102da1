"""The grammar of predicates, actions and requirements (semantics 2 and 7.3), for Lark's LALR parser."""

GRAMMAR = r"""
predicate: implication
?implication: disjunction | disjunction _IMPLIES implication
?disjunction: conjunction | conjunction (_OR conjunction)+
?conjunction: negation | negation (_AND negation)+
?negation: "!" negation -> no | atom
?atom: "(" implication ")" -> group
     | term RELATION term -> comparison
     | NAME "in" "{" [term ("," term)*] "}" -> member
     | truth
     | NAME -> bare
truth: TRUE | FALSE
term: NAME | INTEGER | TRUE | FALSE

action: NAME _GETS term -> assign
      | NAME _INCREASES INTEGER -> add
      | NAME _DECREASES INTEGER -> subtract

requirement: "always" implication -> always
           | "never" implication -> never
           | implication "leads" "to" implication ["within" DURATION] -> leads_to
           | implication "before" implication -> before
           | "after" implication "always" implication "until" implication -> after_always

RELATION: "==" | "!=" | "<=" | "<" | ">=" | ">"
_IMPLIES: "->"
_OR: "||"
_AND: "&&"
_GETS: "<-"
_INCREASES: "+="
_DECREASES: "-="
TRUE: "true"
FALSE: "false"
NAME: /[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*/
INTEGER: /-?[0-9]+/
DURATION: /[0-9]+(\.[0-9]+)?\s*[A-Za-zµ]+/
%ignore /[ \t\r\n\f]+/
"""

KEYWORDS = ("true", "false", "in", "always", "never", "after", "before", "until", "leads", "within")
"""Words that cannot be names."""
