"""What is claimed of a log, and what was decided about it.

answer = Answer(fit, left, members)
Decision(answer, before, floor, unexplained, None, (), (), "").complete
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from planner.arrays import Array
from planner.telemetry.diagnosis.unexplained import Unexplained, unexplained_by
from planner.telemetry.diagnosis.unknown_effect import Proposal
from planner.telemetry.estimation import Fit
from planner.telemetry.holdout import rms
from planner.telemetry.selection import Found, Member, Tried
from planner.telemetry.terms import Addition


@dataclass(frozen=True)
class Answer:
    """One answer to a log.

    Attributes:
        fit: of the model with everything claimed.
        left: (n,) W, its held-out residual.
        members: effects of the catalogue that are claimed.
        additions: how these were added.
        proposal: the formula that is claimed, or None.
        aliases: slug of a member → slugs that explain the log as well.
        beside: (n,) W, what is left where the base model keeps parts that the fit pushed out of
            the members' way; None where it pushed out none.
    """

    fit: Fit
    left: Array
    members: tuple[Member, ...] = ()
    additions: tuple[Addition, ...] = ()
    proposal: Proposal | None = None
    aliases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    beside: Array | None = None

    @property
    def judged(self) -> Array:
        """(n,) W, the held-out residual that the claim is judged by."""
        return self.left if self.beside is None else self.beside

    @property
    def claims(self) -> bool:
        """Whether anything is claimed."""
        return bool(self.members) or self.proposal is not None


@dataclass(frozen=True)
class Decision:
    """What was decided about a log.

    Attributes:
        answer: what is claimed; nothing, where held-out runs support nothing.
        before: (n,) W, held-out residual of the model as it is.
        floor: (n,) W, spread of every row that no model can undercut.
        unexplained: what the answer leaves.
        searched: what the search selected, supported or not; None where it selected nothing.
        alike: slugs of effects that may be there, of which the log does not tell which, or whether
            they are all.
        tried: single effects that were fitted in full.
        near: what decided narrowly, in words; "" where nothing did.
    """

    answer: Answer
    before: Array
    floor: Array
    unexplained: Unexplained
    searched: Answer | None
    alike: tuple[str, ...]
    tried: tuple[Tried, ...]
    near: str

    @property
    def complete(self) -> bool:
        """Whether nothing is missing that the log could show."""
        return not self.answer.claims and not self.alike and self.unexplained.little

    def without_claims(self, found: Found, least_w: float) -> Decision:
        """The decision with nothing claimed; another reading of the log leaves ``least_w``, W."""
        left = unexplained_by(found.log, self.before, self.floor, found.base.watts)
        ratio = max(left.heldout_over_floor, rms(self.before) / least_w)
        left = replace(left, heldout_over_floor=ratio)
        return replace(self, answer=Answer(found.base, self.before), unexplained=left, alike=())
