"""The one bridge to SWI-Prolog.

Prolog predicates that Python may call are *entries*: `entry(+Term, -Dict)`, det. The argument goes
over as Prolog text written by `kb.terms.render`, the answer comes back as one JSON text, and error
terms become exceptions. Calls use SWI-Prolog's C interface: pyswip's own queries keep one open query
for the whole process and never release atoms. SWI-Prolog is one for the process, so one lock makes
its callers take turns; whatever must be kept apart there is kept under a key (a revision, a session).
"""

from __future__ import annotations

import ctypes
import json
import os
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kb.errors import DependencyMissing, InternalError
from kb.terms import Term, quote, render

_PACKAGES = Path(__file__).resolve().parent.parent
_SEARCH_PATH = {"kb_rules": _PACKAGES / "kb" / "rules", "planner_golog": _PACKAGES / "planner" / "golog"}
_STACK_LIMIT_BYTES = 512 * 1024 * 1024


class PrologError(InternalError):
    """A Prolog entry raised an error, or failed.

    Attributes:
        formal: The error term: its functor and arguments, as texts.
    """

    def __init__(self, formal: tuple[str, ...], message: str) -> None:
        super().__init__(f"Prolog: {message}")
        self.formal = formal


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """An entry predicate: module `<alias>_...` in file `<search path>(<file>)`."""

    search_path: str
    file: str
    name: str

    @property
    def module(self) -> str:
        return f"{self.search_path.split('_')[0]}_{self.file}"

    def __call__(self, argument: Term) -> Any:
        """Call the entry; its answer as JSON values.

        Raises:
            PrologError: The entry raised or failed.
            DependencyMissing: SWI-Prolog is not installed.
        """
        answer = json.loads(_call(self, render(argument)))
        if "error" in answer:
            raise PrologError(tuple(answer["error"]), answer["message"])
        return answer["ok"]


class _Engine:
    """SWI-Prolog in this process."""

    def __init__(self) -> None:
        _use_unpacked_swipl()
        try:
            from pyswip import core  # noqa: PLC0415  importing it starts the engine
        except Exception as error:  # pyswip raises whatever it meets when the library is missing
            raise DependencyMissing(
                "SWI-Prolog 9 was not found: install the package swi-prolog-nox, or run `make setup`"
            ) from error
        self._core = core
        self._lib = core._lib
        self._lib.PL_put_chars.argtypes = [core.term_t, ctypes.c_int, ctypes.c_size_t, ctypes.c_char_p]
        self._lib.PL_get_nchars.argtypes = [
            core.term_t,
            ctypes.POINTER(ctypes.c_size_t),
            ctypes.POINTER(ctypes.c_char_p),
            ctypes.c_uint,
        ]
        self._lib.PL_put_term_from_chars.argtypes = [core.term_t, ctypes.c_int, ctypes.c_size_t, ctypes.c_char_p]
        self._text_flags = core.CVT_STRING | core.CVT_ATOM | core.REP_UTF8
        self._query_flags = core.PL_Q_NODEBUG | core.PL_Q_CATCH_EXCEPTION
        self._loaded: set[str] = set()
        self._limit_stack()
        for alias, folder in _SEARCH_PATH.items():
            self._run(f"asserta(user:file_search_path({alias}, {quote(str(folder))}))")
        self._load("kb_rules(bridge)")
        self._bridge = core.PL_predicate(b"bridge", 4, b"kb_bridge")

    def call(self, entry: Entry, argument: str) -> str:
        if self._lib.PL_thread_self() > 0:
            return self._call(entry, argument)
        # Prolog does not know this thread: lend it an engine for the call, as one that it keeps would outlive it.
        self._core.PL_thread_attach_engine(None)
        try:
            self._limit_stack()
            return self._call(entry, argument)
        finally:
            self._lib.PL_thread_destroy_engine()

    def _call(self, entry: Entry, argument: str) -> str:
        spec = f"{entry.search_path}({entry.file})"
        if spec not in self._loaded:
            self._load(spec)
        core, lib = self._core, self._lib
        mark = core.buf_mark_t()  # else the texts of this call would be kept for ever: no foreign predicate returns
        lib.PL_mark_string_buffers(ctypes.byref(mark))
        frame = core.PL_open_foreign_frame()
        try:
            arguments = core.PL_new_term_refs(4)
            for offset, text in enumerate((entry.module, entry.name, argument)):
                data = text.encode()
                lib.PL_put_chars(arguments + offset, core.PL_STRING | core.REP_UTF8, len(data), data)
            if not core.PL_call_predicate(None, self._query_flags, self._bridge, arguments):
                raise InternalError(f"the Prolog bridge failed on {entry.module}:{entry.name}({argument[:200]})")
            length, chars = ctypes.c_size_t(), ctypes.c_char_p()
            lib.PL_get_nchars(arguments + 3, ctypes.byref(length), ctypes.byref(chars), self._text_flags)
            return ctypes.string_at(chars, length.value).decode()
        finally:
            core.PL_discard_foreign_frame(frame)
            lib.PL_release_string_buffers_from_mark(mark)

    def _limit_stack(self) -> None:
        # Holds for one thread; an attached one would have SWI-Prolog's own, larger limit.
        self._run(f"set_prolog_flag(stack_limit, {_STACK_LIMIT_BYTES})")

    def _load(self, spec: str) -> None:
        # A file with a syntax error or an undefined import only prints a warning: make it an error.
        self._run(f"load_files({spec}, [if(not_loaded), must_be_module(true)])")
        self._loaded.add(spec)

    def _run(self, goal: str) -> None:
        core = self._core
        frame = core.PL_open_foreign_frame()
        try:
            term = core.PL_new_term_ref()
            data = goal.encode()  # PL_chars_to_term would take it for Latin-1
            read = self._lib.PL_put_term_from_chars(term, core.REP_UTF8, len(data), data)
            if not read or not core.PL_call(term, None):
                raise InternalError(f"SWI-Prolog did not accept the goal {goal}")
        finally:
            core.PL_discard_foreign_frame(frame)


_lock = threading.RLock()
_engines: list[_Engine] = []


def _call(entry: Entry, argument: str) -> str:
    with _lock:
        if not _engines:
            _engines.append(_Engine())
        return _engines[0].call(entry, argument)


def _use_unpacked_swipl() -> None:
    """Where `make setup` could not install SWI-Prolog, it unpacked it into the virtual environment."""
    unpacked = Path(sys.prefix) / "swipl"
    libraries = sorted(unpacked.glob("usr/lib/*/libswipl.so.9"))
    if libraries and "LIBSWIPL_PATH" not in os.environ:
        os.environ["LIBSWIPL_PATH"] = str(libraries[0])
        os.environ["SWI_HOME_DIR"] = str(unpacked / "usr" / "lib" / "swi-prolog")
