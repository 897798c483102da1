"""The grammar of predicates, actions and requirements (semantics 2 and 7.3), for Lark's LALR parser."""

GRAMMAR = r"""
predicate: implication
?implication: disjunction | disjunction _IMPLIES implication
?disjunction: conjunction | conjunction (_OR conjunction)+
?conjunction: negation | negation (_AND negation)+
?negation: "!" negation -> no | atom
?atom: "(" implication ")" -> group
     | term RELATION term -> comparison
     | NAME _IN "{" [term ("," term)*] "}" -> member
     | truth
     | NAME -> bare
truth: TRUE | FALSE
term: NAME | INTEGER | TRUE | FALSE

action: NAME _GETS term -> assign
      | NAME _INCREASES INTEGER -> add
      | NAME _DECREASES INTEGER -> subtract

requirement: _ALWAYS implication -> always
           | _NEVER implication -> never
           | implication _LEADS _TO implication [_WITHIN DURATION] -> leads_to
           | implication _BEFORE implication -> before
           | _AFTER implication _ALWAYS implication _UNTIL implication -> after_always

RELATION: "==" | "!=" | "<=" | "<" | ">=" | ">"
_IMPLIES: "->"
_OR: "||"
_AND: "&&"
_GETS: "<-"
_INCREASES: "+="
_DECREASES: "-="
_IN.2: /in(?![\w.])/
_ALWAYS.2: /always(?![\w.])/
_NEVER.2: /never(?![\w.])/
_LEADS.2: /leads(?![\w.])/
_TO.2: /to(?![\w.])/
_WITHIN.2: /within(?![\w.])/
_BEFORE.2: /before(?![\w.])/
_AFTER.2: /after(?![\w.])/
_UNTIL.2: /until(?![\w.])/
TRUE: "true"
FALSE: "false"
NAME: /[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*/
INTEGER: /-?[0-9]+/
DURATION: /[0-9]+(\.[0-9]+)?\s*[A-Za-zµ]+/
%ignore /[ \t\r\n\f]+/
"""

KEYWORDS = ("true", "false", "in", "always", "never", "after", "before", "until", "leads", "within")
"""Words that cannot be names."""
