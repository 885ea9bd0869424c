"""A run's log as an independent reader has it: channels, schemas, counts, times, and values against the raw frames.

LOG is a lockstep log of two robots named A and B, of RATE_HZ views a second; LOG_BY_THE_CLOCK is one by the clock.
"""

import math
import os
import struct
import unittest
import xml.etree.ElementTree as ElementTree
from collections import Counter, defaultdict

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

LOG = os.environ["LOG"]
LOG_BY_THE_CLOCK = os.environ["LOG_BY_THE_CLOCK"]
RATE_HZ = 50
PERIOD_NS = 5_000_000
ROBOTS = ["A", "B"]
FRAMES_OF_ROBOT = ["sensors", "robot-truth", "robot-state", "team-command", "joint-command"]
VIEWS = {
    "/tf": "foxglove.FrameTransforms",
    "/scene": "foxglove.SceneUpdate",
    "/team/internal_forces": "internalforces.InternalForces",
    "/team/state": "teamstate.TeamState",
}
VIEWS_OF_ROBOT = {
    "joint_states": "foxglove.JointStates",
    "joint_references": "foxglove.JointStates",
    "wrench/hand/right": "wrench.Wrench",
    "wrench/hand/right/true": "wrench.Wrench",
    "wrench/hand/left": "wrench.Wrench",
    "wrench/hand/left/true": "wrench.Wrench",
    "wrench/foot/right": "wrench.Wrench",
    "wrench/foot/left": "wrench.Wrench",
    "balance": "balance.Balance",
}
ONCE = {"/tf_static": "foxglove.FrameTransforms", "/scene/static": "foxglove.SceneUpdate"}


def views():
    of_robots = {f"/robot/{robot}/{name}": schema for robot in ROBOTS for name, schema in VIEWS_OF_ROBOT.items()}
    return VIEWS | of_robots


class Log:
    """The whole log, read once."""

    def __init__(self, path):
        with open(path, "rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            self.summary = reader.get_summary()
            self.channels = {channel.topic: channel for channel in self.summary.channels.values()}
            self.attachments = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
            self.frames = defaultdict(dict)
            self.messages = defaultdict(list)
            for schema, channel, message in reader.iter_messages():
                if channel.message_encoding == "mikoshi":
                    self.frames[channel.topic][message.log_time] = Frame(schema, message)
            decodable = [topic for topic, channel in self.channels.items() if channel.message_encoding == "protobuf"]
            for _, channel, message, decoded in reader.iter_decoded_messages(topics=decodable):
                self.messages[channel.topic].append((message.log_time, decoded))

    def schema(self, topic):
        return self.summary.schemas[self.channels[topic].schema_id]


class Frame:
    """A raw frame, by the schema beside it: a line for each field, with its name, type, offset and size."""

    def __init__(self, schema, message):
        self.fields = {}
        for line in schema.data.decode().splitlines():
            name, scalar, offset, size = line.split()
            letter = {"f64": "d", "u64": "Q"}[scalar]
            self.fields[name] = (f"<{int(size) // 8}{letter}", int(offset))
        self.data = message.data

    def __getitem__(self, name):
        form, offset = self.fields[name]
        return struct.unpack_from(form, self.data, offset)


def of(vector):
    return (vector.x, vector.y, vector.z)


def pose_of(transform):
    q = transform.rotation
    return of(transform.translation), (q.w, q.x, q.y, q.z)


def product(p, q):
    (a, b, c, d), (e, f, g, h) = p, q
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def rotated(q, v):
    w, x, y, z = q
    return product(product(q, (0.0, *v)), (w, -x, -y, -z))[1:]


def chained(parent, child):
    (p, q), (r, s) = parent, child
    return tuple(a + b for a, b in zip(p, rotated(q, r))), product(q, s)


class TheLog(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.log = Log(LOG)
        cls.ticks = len(cls.log.frames["object-truth/team"])

    def test_has_every_frame_of_every_tick(self):
        topics = ["object-truth/team", "team-state/team"]
        topics += [f"{frame}/{robot}" for frame in FRAMES_OF_ROBOT for robot in ROBOTS]
        self.assertEqual(set(self.log.frames), set(topics))
        self.assertGreater(self.ticks, 100)
        times = [tick * PERIOD_NS for tick in range(self.ticks)]
        for topic in topics:
            self.assertEqual(list(self.log.frames[topic]), times, topic)

    def test_has_every_view_at_its_rate_in_its_schema(self):
        self.assertEqual(
            {topic for topic, channel in self.log.channels.items() if channel.message_encoding == "protobuf"},
            set(views()) | set(ONCE) | {"/log"},
        )
        every_ns = 1_000_000_000 // RATE_HZ
        times = list(range(0, self.ticks * PERIOD_NS, every_ns))
        for topic, schema in views().items():
            self.assertEqual(self.log.schema(topic).name, schema)
            self.assertEqual(self.log.schema(topic).encoding, "protobuf")
            self.assertEqual([time for time, _ in self.log.messages[topic]], times, topic)
        for topic, schema in ONCE.items():
            self.assertEqual(self.log.schema(topic).name, schema)
            self.assertEqual([time for time, _ in self.log.messages[topic]], [0], topic)

    def test_counts_in_its_summary_what_is_in_it(self):
        counts = self.log.summary.statistics.channel_message_counts
        for topic, channel in self.log.channels.items():
            found = len(self.log.frames.get(topic) or self.log.messages.get(topic) or ())
            self.assertEqual(counts.get(channel.id, 0), found, topic)

    def test_says_in_messages_when_they_are_of(self):
        def stamps(message):
            for field in ("transforms", "entities"):
                yield from (part.timestamp for part in getattr(message, field, ()))
            if "timestamp" in message.DESCRIPTOR.fields_by_name:
                yield message.timestamp

        for topic, messages in self.log.messages.items():
            for time, message in messages:
                found = {stamp.seconds * 1_000_000_000 + stamp.nanos for stamp in stamps(message)}
                self.assertEqual(found, {time}, topic)

    def test_leads_by_transforms_from_the_world_to_where_hands_soles_and_object_are(self):
        fixed = {t.child_frame_id: t for _, message in self.log.messages["/tf_static"] for t in message.transforms}
        for time, message in self.log.messages["/tf"]:
            transforms = fixed | {transform.child_frame_id: transform for transform in message.transforms}

            def pose(name):
                own, parent = pose_of(transforms[name]), transforms[name].parent_frame_id
                return own if parent == "world" else chained(pose(parent), own)

            truth = self.log.frames["object-truth/team"][time]["pose"]
            self.assertEqual((*pose("object")[0], *pose("object")[1]), truth)
            for robot in ROBOTS:
                truth = self.log.frames[f"robot-truth/{robot}"][time]
                expected = {
                    "r_palm": truth["hand_pose"][:7],
                    "l_palm": truth["hand_pose"][7:14],
                    "r_sole": truth["sole_pose"][:7],
                    "l_sole": truth["sole_pose"][7:14],
                }
                for link, (*position, w, x, y, z) in expected.items():
                    found, rotation = pose(f"{robot}/{link}")
                    self.assertLess(math.dist(found, position), 1e-9, (time, robot, link))
                    sine = product(rotation, (w, -x, -y, -z))[1:]
                    self.assertLess(math.hypot(*sine), 1e-9, (time, robot, link))

    def test_knows_where_references_hang_once_there_are_any(self):
        _, message = self.log.messages["/tf"][-1]
        parents = {transform.child_frame_id: transform.parent_frame_id for transform in message.transforms}
        for robot in ROBOTS:
            self.assertEqual(parents[f"{robot}/odometry"], "world")
            self.assertEqual(parents[f"{robot}/base_measured"], f"{robot}/odometry")
            self.assertEqual(parents[f"{robot}/left_ref"], f"{robot}/odometry")
        self.assertEqual(parents["object_ref"], "world")

    def test_has_joints_wrenches_and_internal_forces_as_they_were_said(self):
        for robot in ROBOTS:
            for time, message in self.log.messages[f"/robot/{robot}/joint_states"]:
                frame = self.log.frames[f"sensors/{robot}"][time]
                count = len(message.joints)
                self.assertEqual(tuple(joint.position for joint in message.joints), frame["joint_position_rad"][:count])
                self.assertEqual(tuple(joint.effort for joint in message.joints), frame["joint_torque_nm"][:count])
            for time, message in self.log.messages[f"/robot/{robot}/joint_references"]:
                frame = self.log.frames[f"joint-command/{robot}"][time]
                found = tuple(joint.position for joint in message.joints)
                self.assertEqual(found, frame["joint_position_ref_rad"][: len(found)])
            for time, message in self.log.messages[f"/robot/{robot}/wrench/hand/left"]:
                wrench = self.log.frames[f"robot-state/{robot}"][time]["hand_wrench"][6:12]
                self.assertEqual((*of(message.force_n), *of(message.torque_nm)), wrench)
                self.assertEqual(message.frame_id, f"{robot}/odometry")
        for time, message in self.log.messages["/team/internal_forces"]:
            self.assertEqual([row.name for row in message.rows], ["A|B", "A.right|A.left", "B.right|B.left"])
            forces = self.log.frames["team-state/team"][time]["generalized_force"]
            for row, measured in zip(message.rows, forces[6::6]):
                self.assertEqual(row.force_measured_n.x, measured)

    def test_shows_object_robots_and_what_carries_them(self):
        time, last = self.log.messages["/scene"][-1]
        entities = {entity.id: entity for entity in last.entities}
        self.assertEqual(set(entities), {"object", "A/balance", "B/balance"})
        self.assertEqual(entities["object"].frame_id, "object")
        for robot in ROBOTS:
            balance = entities[f"{robot}/balance"]
            self.assertEqual(len(balance.arrows), 2)
            self.assertGreaterEqual(len(balance.lines[0].points), 4)
            position = balance.spheres[0].pose.position
            truth = self.log.frames[f"robot-truth/{robot}"][time]
            self.assertEqual((position.x, position.y), truth["zmp_position_m"])
        frames = {t.child_frame_id for _, message in self.log.messages["/tf"][:1] for t in message.transforms}
        [(_, models)] = self.log.messages["/scene/static"]
        shapes = Counter(entity.frame_id.split("/")[0] for entity in models.entities if entity.cubes or entity.cylinders)
        self.assertEqual(set(shapes), set(ROBOTS))
        for entity in models.entities:
            self.assertTrue(entity.frame_locked)
            self.assertIn(entity.frame_id, frames)

    def test_says_what_the_team_did(self):
        self.assertEqual([message.message for _, message in self.log.messages["/log"]], ["hold", "carry"])
        self.assertEqual(self.log.messages["/team/state"][-1][1].mode, "carry")

    def test_says_by_the_clock_how_long_ticks_took(self):
        log = Log(LOG_BY_THE_CLOCK)
        self.assertEqual(set(log.messages), set(self.log.messages) | {"/timing"})
        self.assertEqual(log.schema("/timing").name, "timing.Timing")
        times = [time for time, _ in log.messages["/timing"]]
        self.assertEqual(times, [time for time, _ in log.messages["/tf"]])
        _, timing = log.messages["/timing"][-1]
        self.assertEqual([servo.robot for servo in timing.servos], ROBOTS)
        for time_s in (timing.tick_max_s, timing.bridge_max_s, timing.coordinator_max_s, timing.servos[0].act_max_s):
            self.assertGreater(time_s, 0.0)

    def test_holds_scenario_robots_and_world(self):
        self.assertEqual(ElementTree.fromstring(self.log.attachments["hrp2.urdf"]).tag, "robot")
        self.assertEqual(ElementTree.fromstring(self.log.attachments["world.xml"]).tag, "mujoco")
        self.assertIn(b"[object]", self.log.attachments["scenario.toml"])


if __name__ == "__main__":
    unittest.main()
