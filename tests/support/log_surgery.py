"""Takes logs apart, changes one thing, and puts them together again with valid checksums."""

import json
from math import inf, nextafter

from palpate.adapters.log.container import LogFile, read_messages
from palpate.adapters.log.schema import BY_ID, BY_TOPIC, message_class

_BATCH = 14


def messages_of(path):
    """All messages of a sound log."""
    messages, damage = read_messages(str(path), path.read_bytes())
    if damage:
        raise ValueError(damage)
    return messages


def write_log(path, messages):
    """A sound log of these messages, numbered again."""
    with path.open("xb") as file:
        log = LogFile(file, {})
        for batch in range(0, len(messages), _BATCH):
            few = enumerate(messages[batch : batch + _BATCH], start=batch)
            log.add(message._replace(sequence=number) for number, message in few)
        log.finish()
    return path


def indices(messages, topic):
    """Where the messages of a channel are."""
    return [i for i, message in enumerate(messages) if message.channel == BY_TOPIC[topic].id]


def changed(messages, index, change):
    """The messages, with one of them changed."""
    message = messages[index]
    made = message_class(BY_ID[message.channel].message)()
    made.ParseFromString(message.payload)
    change(made)
    copy = list(messages)
    copy[index] = message._replace(payload=made.SerializeToString(deterministic=True))
    return copy


def one_ulp(field, place=None, upwards=True):
    """A change of a number by one unit in the last place; of one number of a vector, if a place is given."""
    towards = inf if upwards else -inf

    def change(made):
        if place is None:
            setattr(made, field, nextafter(getattr(made, field), towards))
        else:
            values = getattr(made, field)
            values[place] = nextafter(values[place], towards)

    return change


def in_start(**fields):
    """Other values for fields of the start; those that end in ``_json`` are written as JSON."""

    def change(made):
        for name, value in fields.items():
            setattr(made, name, json.dumps(value) if name.endswith("_json") else value)

    return change
