"""The slugs: the identifiers that all errors and warnings have in brackets.

`src/scbm/cli/messages.md` describes each with its remedy, for `scbm help SLUG` and for the page of messages.
"""

from enum import StrEnum


class Slug(StrEnum):
    """A short stable identifier; part of the interface, so renaming one breaks users."""

    # the file
    FILE_MISSING = "file-missing"
    FILE_IS_DIRECTORY = "file-is-directory"
    FILE_UNREADABLE = "file-unreadable"
    FILE_TOO_LARGE = "file-too-large"
    FILE_EMPTY = "file-empty"
    NOT_UTF8 = "not-utf8"
    YAML_SYNTAX = "yaml-syntax"
    YAML_TAG = "yaml-tag"
    YAML_TOO_LARGE = "yaml-too-large"

    # its shape
    WRONG_SHAPE = "wrong-shape"
    MISSING_KEY = "missing-key"
    UNKNOWN_KEY = "unknown-key"
    DUPLICATE_KEY = "duplicate-key"

    # names, values, domains
    BAD_NAME = "bad-name"
    RESERVED_NAME = "reserved-name"
    DUPLICATE_NAME = "duplicate-name"
    AMBIGUOUS_SYMBOL = "ambiguous-symbol"
    BAD_DOMAIN = "bad-domain"
    EMPTY_DOMAIN = "empty-domain"
    DOMAIN_TOO_LARGE = "domain-too-large"
    VALUE_OUTSIDE_DOMAIN = "value-outside-domain"
    DUPLICATE_VALUE = "duplicate-value"

    # objects and parameters
    UNKNOWN_TYPE = "unknown-type"
    UNKNOWN_OBJECT = "unknown-object"
    UNKNOWN_TABLE = "unknown-table"
    TYPE_CYCLE = "type-cycle"
    WRONG_ROW = "wrong-row"
    WRONG_INDEX = "wrong-index"
    NOT_STATIC = "not-static"
    TOO_MANY_INSTANCES = "too-many-instances"

    # durations, distributions
    BARE_DURATION = "bare-duration"
    BAD_DURATION = "bad-duration"
    BAD_LATENCY = "bad-latency"
    NOT_A_DISTRIBUTION = "not-a-distribution"

    # waivers
    BAD_DATE = "bad-date"

    # predicates, actions, requirements
    PREDICATE_SYNTAX = "predicate-syntax"
    ACTION_SYNTAX = "action-syntax"
    REQUIREMENT_SYNTAX = "requirement-syntax"
    TOO_DEEP = "too-deep"
    TEXT_TOO_LONG = "text-too-long"
    UNKNOWN_VARIABLE = "unknown-variable"
    UNKNOWN_NAME = "unknown-name"
    NOT_A_PREDICATE = "not-a-predicate"
    COMPARES_NO_VARIABLE = "compares-no-variable"
    DIFFERENT_KINDS = "different-kinds"
    DISJOINT_DOMAINS = "disjoint-domains"
    ORDER_NEEDS_INTEGERS = "order-needs-integers"
    ASSIGNED_TWICE = "assigned-twice"
    NOT_ASSIGNABLE = "not-assignable"
    NOT_A_COUNTER = "not-a-counter"
    NEVER_FITS = "never-fits"
    RUNNER_VARIABLE = "runner-variable"
    AUTOMATIC_DOES_NOTHING = "automatic-does-nothing"

    # bindings of resources to drivers
    BAD_BINDING = "bad-binding"
    BAD_ROS_NAME = "bad-ros-name"
    BAD_ROS_TYPE = "bad-ros-type"
    UNKNOWN_FIELD = "unknown-field"
    MISSING_FIELD = "missing-field"
    WRONG_TYPE = "wrong-type"
    BAD_RANGE = "bad-range"
    UNBOUND_REQUEST = "unbound-request"
    TYPES_DIFFER = "types-differ"

    # what a command asks for
    BAD_OPTION = "bad-option"
    UNKNOWN_GOAL = "unknown-goal"
    NO_GOALS = "no-goals"
    NO_INITIAL_STATE = "no-initial-state"
    INITIAL_STATE_NOT_FOUND = "initial-state-not-found"
    INITIAL_STATE_NOT_ALLOWED = "initial-state-not-allowed"
    NO_CASES = "no-cases"

    # planners
    UNKNOWN_PLANNER = "unknown-planner"
    PLANNER_MISSING = "planner-missing"
    PLANNER_FAILED = "planner-failed"

    # models in PDDL
    BAD_PDDL = "bad-pddl"
    PDDL_GROUP_UNPROVED = "pddl-group-unproved"
    PDDL_MISSING = "pddl-missing"
    DRAWING_MISSING = "drawing-missing"
    PICTURE_TOO_LARGE = "picture-too-large"
    CONSOLE_MISSING = "console-missing"
    PDDL_NOT_EXPRESSIBLE = "pddl-not-expressible"

    # test cases
    UNKNOWN_OPERATION = "unknown-operation"
    UNKNOWN_RESOURCE = "unknown-resource"
    UNKNOWN_OBLIGATION = "unknown-obligation"
    UNKNOWN_WORD = "unknown-word"
    AMBIGUOUS_SUBJECT = "ambiguous-subject"
    NOT_A_SHARE = "not-a-share"
    NEGATIVE_TIME = "negative-time"
    BAD_NUMBER = "bad-number"
    CONTRADICTION = "contradiction"
    NOTHING_DRAWN = "nothing-drawn"
    NEVER_COMES = "never-comes"
    MODEL_MISSING = "model-missing"

    # files that scbm writes
    FORMAT_VERSION = "format-version"

    # traces and replay
    BAD_TRACE = "bad-trace"
    REPLAY_DIFFERS = "replay-differs"
    BAD_LOG = "bad-log"
    LOG_OTHER_MODEL = "log-other-model"

    # nodes
    BUS_UNUSABLE = "bus-unusable"
    CELL_INCOMPLETE = "cell-incomplete"
    BEYOND_REACH = "beyond-reach"

    # workers of campaigns
    WORKERS_LOST = "workers-lost"
    CLUSTER_UNUSABLE = "cluster-unusable"

    # coverage stores
    NOT_A_STORE = "not-a-store"
    STORE_DAMAGED = "store-damaged"
    STORE_OTHER_MODEL = "store-other-model"
    STORE_EMPTY = "store-empty"
    STORE_UNUSABLE = "store-unusable"

    # certificates
    BAD_CERTIFICATE = "bad-certificate"
    CERTIFICATE_WRONG = "certificate-wrong"

    # doubts that `scbm check` has about a model that loads
    GUARD_NEVER_HOLDS = "guard-never-holds"
    REQUIREMENT_ALWAYS_HOLDS = "requirement-always-holds"
    OPERATION_NEVER_ENABLED = "operation-never-enabled"
    GOAL_UNREACHABLE = "goal-unreachable"
    GOAL_NOT_ALWAYS_REACHABLE = "goal-not-always-reachable"
    DOMAIN_LEFT = "domain-left"
    AUTOMATIC_LIVELOCK = "automatic-livelock"
    INITIAL_STATE_NOMINAL = "initial-state-nominal"
    PLANNER_READS_RUNNER = "planner-reads-runner"
    FAILURE_UNNOTICED = "failure-unnoticed"
    NO_DEADLINE = "no-deadline"
    DEADLINE_TOO_SHORT = "deadline-too-short"
    REPLY_NEVER_CARRIES = "reply-never-carries"
    REQUEST_NOT_CLEARED = "request-not-cleared"
    HANDSHAKE_INCOMPLETE = "handshake-incomplete"
    UNDECLARED_SOURCE = "undeclared-source"
    GOALS_EXCLUDE = "goals-exclude"
    NEVER_ASSIGNED = "never-assigned"
    UNUSED_VARIABLE = "unused-variable"
    WAIVER_DATE = "waiver-date"
    NO_INSTANCE = "no-instance"
    COUNT_ALWAYS_HOLDS = "count-always-holds"
    SUM_ALWAYS_HOLDS = "sum-always-holds"
