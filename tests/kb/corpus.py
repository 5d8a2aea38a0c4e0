"""All planted faults, by the code that each is found as."""

from __future__ import annotations

from tests.kb.faults import Fault
from tests.kb.test_failure_faults import FAILURES
from tests.kb.test_faults import QUICK, REASONED
from tests.kb.test_file_faults import FILES, UNUSED
from tests.kb.test_idle_faults import DOUBTS
from tests.kb.test_kind_faults import KINDS
from tests.kb.test_program_faults import GROUPS
from tests.kb.test_rule_faults import RULES
from tests.kb.test_topic_faults import TOPICS

CORPUS: list[Fault] = [
    *QUICK,
    *KINDS,
    *FILES,
    *UNUSED,
    *FAILURES,
    *TOPICS,
    *REASONED,
    *(case for group in [*GROUPS, *DOUBTS, *RULES] for case in group),
]
