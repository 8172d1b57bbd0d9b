"""Compares descriptions of messages with Foxglove's published package."""

from importlib import import_module

from google.protobuf import descriptor_pb2
from google.protobuf.descriptor import FieldDescriptor


def published(name: str):
    """Returns the descriptor of one of Foxglove's messages."""
    module = import_module(f"foxglove_schemas_protobuf.{name}_pb2")
    return getattr(module, name).DESCRIPTOR


def check_schema(data: bytes) -> None:
    """The description of the messages is that of the published package."""
    files = descriptor_pb2.FileDescriptorSet.FromString(data).file
    (ours,) = (file for file in files if file.package == "foxglove")
    for message in ours.message_type:
        theirs = published(message.name)
        fields = {
            (f.name, f.number, f.type, f.label == FieldDescriptor.LABEL_REPEATED, f.type_name)
            for f in message.field
        }
        expected = set()
        for field in theirs.fields:
            target = field.message_type or field.enum_type
            repeated = field.is_repeated
            name = f".{target.full_name}" if target else ""
            expected.add((field.name, field.number, field.type, repeated, name))
        assert fields == expected, (message.name, fields ^ expected)
        for enum in message.enum_type:
            values = {(value.name, value.number) for value in enum.value}
            theirs_values = theirs.enum_types_by_name[enum.name].values
            assert values == {(value.name, value.number) for value in theirs_values}
