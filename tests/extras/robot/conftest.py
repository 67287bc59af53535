"""What the tests of this extra rest on."""

from cli.conftest import tomoskin
from run.conftest import patient_links
from run.sinks.conftest import listener, program, stream

__all__ = ["listener", "patient_links", "program", "stream", "tomoskin"]
