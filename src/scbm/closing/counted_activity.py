"""What a long command does now, with how much of it is done."""

from __future__ import annotations


class CountedActivity(str):
    """A description of an activity, of which a limit says how much there is at most.

    Attributes:
        name: the activity without counts.
        done: how much of it is done.
        most: how much of it there is at most.
    """

    __slots__ = ("done", "most", "name")
    name: str
    done: int
    most: int

    @classmethod
    def of(cls, name: str, done: int, most: int, noun: str) -> CountedActivity:
        """Return `name: 20,000 of at most 300,000 situations`; `noun` is `situations` then."""
        return cls._with(f"{name}: {done:,} of at most {most:,} {noun}", name, done, most)

    def behind(self, prefix: str) -> CountedActivity:
        """Return the same activity with words before it."""
        return self._with(f"{prefix}{self}", self.name, self.done, self.most)

    @classmethod
    def _with(cls, text: str, name: str, done: int, most: int) -> CountedActivity:
        made = cls(text)
        made.name, made.done, made.most = name, done, most
        return made
