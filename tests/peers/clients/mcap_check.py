"""Reads a recording with independent software: the `mcap` package's validating reader, Foxglove's protobuf
descriptors as the file carries them, and `jsonschema`.

    pip install -r tests/peers/clients/mcap_check.txt
    python tests/peers/clients/mcap_check.py runs/<name>/episode.mcap       # or what a killed server left, episode.mcap.partial

Prints one line per topic; exits 1 with the reason if anything is wrong.
"""

import collections
import json
import sys

import jsonschema
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap_protobuf.decoder import DecoderFactory

WELL_KNOWN = {
    "/tf": "foxglove.FrameTransforms",
    "/scene": "foxglove.SceneUpdate",
    "/A/joint_states": "foxglove.JointStates",
    "/B/joint_states": "foxglove.JointStates",
}
OURS = {"/A/action", "/B/action", "/A/base_command", "/B/base_command", "/A/hands", "/B/hands", "/budget", "/phases", "/tool_calls", "/notes"}
CONTROL_STEP_NS = 20_000_000


class Broken(Exception):
    """The recording is wrong."""


def expect(condition, reason):
    if not condition:
        raise Broken(reason)


def decode(schema, channel, message, factory, validators):
    """Returns the message as protobuf object or dict. Raises an exception if it does not fit its schema."""
    if channel.message_encoding == "json":
        if schema.id not in validators:
            document = json.loads(schema.data)
            jsonschema.Draft202012Validator.check_schema(document)
            validators[schema.id] = jsonschema.Draft202012Validator(document)
        decoded = json.loads(message.data)
        validators[schema.id].validate(decoded)
        return decoded
    if channel.message_encoding == "tandem":
        expect(message.data[0] in (1, 2), f"{channel.topic}: a message of kind {message.data[0]}")
        return message.data
    decoder = factory.decoder_for(channel.message_encoding, schema)
    expect(decoder is not None, f"{channel.topic}: nothing decodes {channel.message_encoding}")
    return decoder(message.data)


def check_transforms(update, topic, time_ns):
    """Checks that every frame has one parent, and unit quaternions."""
    children = [transform.child_frame_id for transform in update.transforms]
    expect(len(children) == len(set(children)), f"{topic}: a frame has two parents at {time_ns} ns")
    known = set(children) | {"world"}
    for transform in update.transforms:
        q = transform.rotation
        norm = (q.x**2 + q.y**2 + q.z**2 + q.w**2) ** 0.5
        expect(abs(norm - 1) < 1e-3, f"{transform.child_frame_id}: quaternion of norm {norm} at {time_ns} ns")
        expect(transform.parent_frame_id in known, f"{transform.parent_frame_id} is no frame")
    return set(children)


def messages(reader, path):
    """Yields every message. Only an interrupted recording may end without a footer."""
    try:
        yield from reader.iter_messages(log_time_order=False)
    except EndOfFile:
        expect(path.endswith(".partial"), "the file ends too early")


def check(path):
    factory, validators = DecoderFactory(), {}
    counts, schemas, last_ns = collections.Counter(), {}, 0
    frames, drawn_in, step_times_ns = set(), set(), []
    with open(path, "rb") as stream:
        # Reads records front to back as they lie, chunk checksums included.
        reader = NonSeekingReader(stream, validate_crcs=True)
        for schema, channel, message in messages(reader, path):
            topic = channel.topic
            expect(message.log_time >= last_ns, f"{topic}: time runs backwards at {message.log_time} ns")
            expect(message.sequence == counts[topic], f"{topic}: sequence {message.sequence} after {counts[topic]}")
            last_ns = message.log_time
            counts[topic] += 1
            schemas[topic] = schema.name
            decoded = decode(schema, channel, message, factory, validators)
            if topic == "/tf":
                frames |= check_transforms(decoded, topic, last_ns)
            if topic == "/budget":
                step_times_ns.append(last_ns)
            if topic == "/scene":
                drawn_in |= {entity.frame_id for entity in decoded.entities}
            if topic.endswith("/action"):
                columns = channel.metadata["columns"].split(",")
                expect(len(decoded["row"]) == len(columns) == 35, f"{topic}: {len(decoded['row'])} columns")
    if path.endswith(".partial"):
        print(f"{path}: fine up to {last_ns / 1e9:.2f} s; {sum(counts.values())} messages")
        return
    with open(path, "rb") as stream:
        summary = make_reader(stream, validate_crcs=True).get_summary()
        expect(summary is not None and summary.statistics is not None, "no summary: the file was not finished")
        expect(summary.statistics.message_count == sum(counts.values()), "the summary counts other messages")
    with open(path, "rb") as stream:
        metadata = {record.name: record.metadata for record in make_reader(stream).iter_metadata()}

    for topic, name in WELL_KNOWN.items():
        expect(schemas.get(topic) == name, f"{topic} carries {schemas.get(topic)}; expected {name}")
    steps = counts["/budget"]
    per_step = [topic for topic in schemas if topic.split("/")[-1] in ("joint_states", "action", "base_command", "hands", "budget")]
    for topic in per_step:
        expect(counts[topic] == steps, f"{topic} has {counts[topic]} messages for {steps} steps")
    missing = {topic for topic in OURS - {"/phases", "/tool_calls", "/notes"} if topic not in schemas}
    expect(not missing, f"no messages on {sorted(missing)}")
    gaps_ns = {b - a for a, b in zip(step_times_ns, step_times_ns[1:])}
    expect(gaps_ns <= {CONTROL_STEP_NS}, f"control steps are {sorted(gaps_ns)} ns apart; expected {CONTROL_STEP_NS}")
    expect(drawn_in <= frames | {"world"}, f"drawn in frames that no transform moves: {sorted(drawn_in - frames)}")
    expect("episode" in metadata and "result" in metadata, f"metadata has only {sorted(metadata)}")
    result = json.loads(metadata["result"]["result.json"])
    expect(str(result["seed"]) == metadata["episode"]["seed"], "episode and result name different seeds")

    for topic in sorted(schemas):
        print(f"{topic:32} {schemas[topic]:28} {counts[topic]:6}")
    print(f"{path}: fine; {steps} steps, {len(frames)} frames, {last_ns / 1e9:.2f} s")


if __name__ == "__main__":
    try:
        check(sys.argv[1])
    except (Broken, McapError, RuntimeError, jsonschema.ValidationError, jsonschema.SchemaError) as error:
        # lz4 reports damaged data as RuntimeError.
        sys.exit(f"{sys.argv[1]}: {type(error).__name__}: {error}")
