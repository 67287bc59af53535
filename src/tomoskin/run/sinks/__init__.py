"""Where results go while they are made: sinks, which are registered by their names."""

from tomoskin.files.messages import (
    Contact as Contact,
    Contacts as Contacts,
    Item as Item,
    Naming as Naming,
    Stream as Stream,
)
from tomoskin.run.sinks.sink import (
    Sink as Sink,
    SinkConsumer as SinkConsumer,
    SinkReport as SinkReport,
    example_of as example_of,
    make_sink as make_sink,
    options_of as options_of,
    port_of as port_of,
    sink_names as sink_names,
    sink_report as sink_report,
    sink_worker as sink_worker,
    tried_with as tried_with,
)
