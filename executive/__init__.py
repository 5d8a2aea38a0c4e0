"""Concertmaster's executive: takes tasks, plans them, has robots do them."""

from executive.events import TaskStatus as TaskStatus
from executive.fleet import Fleet as Fleet
from executive.fleet import TaskHandle as TaskHandle
from executive.shell import TaskResult as TaskResult
