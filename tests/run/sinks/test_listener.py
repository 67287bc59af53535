"""Contacts for a function of the same program, and the lines of docs/robot.md that use it."""

from __future__ import annotations

import queue
from dataclasses import replace

import pytest

from files.session.runs import TOUCH
from run.sinks.conftest import EVENT, PATIENCE, begin, robot_program
from tomoskin.board import source
from tomoskin.run import sinks as sink
from tomoskin.run.sinks import ContactListener, Naming
from tomoskin.twin import Press

MOST_LINES = 15


def test_a_function_gets_the_contacts_of_each_frame(stream):
    heard = []
    sink = ContactListener(heard.append, Naming("left_arm"))
    contacts_at = begin(sink, replace(stream, clock=lambda: 0.5))
    sink.publish(EVENT)
    sink.publish(contacts_at(0.1))
    sink.publish(contacts_at(0.2, TOUCH, sequence=9))
    sink.publish(replace(contacts_at(0.3), valid=False, problem="E4 is dead"))
    sink.close()
    assert [len(contacts.touches) for contacts in heard] == [0, 1, 0]
    assert [contacts.valid for contacts in heard] == [True, True, False]
    contacts = heard[1]
    assert (contacts.skin, contacts.frame_id) == (stream.skin, "left_arm/skin")
    assert (contacts.sequence, contacts.latency) == (9, pytest.approx(0.3))
    assert contacts.touches[0].position == (TOUCH.detection.x, TOUCH.detection.y, 0)
    assert heard[2].problem == "E4 is dead"


def test_the_first_lines_of_the_documentation_react_to_a_touch(monkeypatch):
    program = robot_program("tomoskin")
    assert len([line for line in program.splitlines() if line.strip()]) <= MOST_LINES
    open_source, opened = source.open_source, []
    heard, standing = queue.SimpleQueue(), queue.SimpleQueue()

    def keep(*arguments):
        opened.append(open_source(*arguments))
        return opened[-1]

    def listener(react):
        return ContactListener(lambda contacts: (standing.put(contacts.valid), react(contacts)))

    def press(_):
        """Once the reference stands: a press before would be a part of it."""
        while not standing.get(timeout=PATIENCE):
            pass
        (twin,) = opened
        twin.set_presses((Press(0.03, 0.02, force=5.0, radius=0.015),))
        said.append(heard.get(timeout=PATIENCE))

    said = []
    monkeypatch.setattr(source, "open_source", keep)
    monkeypatch.setattr(sink, "ContactListener", listener)
    names = {"print": lambda *words: heard.put(words), "input": press}
    exec(compile(program, "robot.md", "exec"), names)
    ((_, position, normal),) = said
    assert position == pytest.approx((0.03, 0.02, 0), abs=0.015)
    assert normal == (0, 0, 1)
