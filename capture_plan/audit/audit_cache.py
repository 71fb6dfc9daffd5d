"""The audit of a rig, found once: a head of 26,000 vertices takes seconds, and every command asks for it.

Key    everything that the rig is, and the code of the rooms that an audit is made in
Cached the audit as text
"""

import msgspec
import numpy as np

from capture_plan.audit.audit import Audit, audit_rig
from capture_plan.cache import Arrays, cached, code_digest, digest
from capture_plan.reader.read_cache import ROOMS, everything_of
from capture_plan.rig.record import Rig

AUDITING = (*ROOMS, "anatomy", "audit")
ENTRIES = 100  # some 30 kB each


def audit_once(rig: Rig) -> Audit:
    """`audit(rig)`, or what it answered for an equal rig."""

    def found() -> Arrays:
        return {"audit": np.frombuffer(msgspec.json.encode(audit_rig(rig)), dtype=np.uint8)}

    name = digest([code_digest(*AUDITING), *everything_of(rig)])
    return msgspec.json.decode(cached(found, "audits", name, entries=ENTRIES)["audit"].tobytes(), type=Audit)
