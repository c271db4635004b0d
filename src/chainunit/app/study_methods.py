"""The methods that capabilities bring to `Study`. Their types, by name, are in study_methods.pyi, which
`docs/make_types.py` writes for type checkers: they do not see what the list of capabilities brings."""

from __future__ import annotations

from ..study.registry import modules


class StudyMethods:
    """The methods of `Study` that capabilities bring."""


for _module in modules("study_method"):
    setattr(StudyMethods, _module.METHOD.__name__, _module.METHOD)
