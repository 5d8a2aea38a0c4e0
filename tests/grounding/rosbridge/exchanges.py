"""Exchanges of the rosbridge v2 protocol, written from its specification: what clients send, what they must get.

A server that passes `EXCHANGES` speaks the protocol. It starts empty for each of them: no topics, services or actions
but those of rosapi. `Sends` and `Leaves` say what a client does, `Gets` what its next frame is. A step is over before
the next begins: who runs them over sockets waits, after each `Sends`, for the answer to a call of `/rosapi/get_time` of
its own. Nothing else comes than is said, but for status messages of level info and warning, which a server may send at
any time: they are passed over where they are not expected.

Where the specification leaves open what happens to a request that cannot be done, it is answered: a call by a
`service_response`, a goal by an `action_result`, both with `result: false` and the reason; all else by a status.
"""

from __future__ import annotations

from grounding.rosbridge.framing import png_of, split
from tests.grounding.rosbridge.call_exchanges import ACTION_EXCHANGES, SERVICE_EXCHANGES
from tests.grounding.rosbridge.steps import (
    WHOLE,
    Exchange,
    FromServer,
    Gets,
    Leaves,
    Like,
    Saved,
    Sends,
    Step,
    exchange,
    filled_in,
    gets,
    is_told,
    matches,
    nothing_before,
    sends,
    wrong,
)

__all__ = ["EXCHANGES", "FROM_SERVER", "Exchange", "FromServer", "Gets", "Leaves", "Like", "Saved", "Sends", "Step",
           "filled_in", "matches"]  # fmt: skip

_A_LISTENS = sends("A", "subscribe", topic="/chat", type="std_msgs/String", id="s1")
_B_SPEAKS = sends("B", "advertise", topic="/chat", type="std_msgs/msg/String", id="a1")
_HELLO = sends("B", "publish", topic="/chat", msg={"data": "hello"})
_A_HEARS = gets("A", "publish", topic="/chat", msg={"data": "hello"})

_TOPICS = (
    exchange("a message reaches a subscriber", "advertise subscribe publish", _A_LISTENS, _B_SPEAKS, _HELLO, _A_HEARS),
    exchange(
        "who publishes and listens hears itself",
        "publish subscribe",
        sends("A", "advertise", topic="/chat", type="std_msgs/String"),
        sends("A", "subscribe", topic="/chat"),
        sends("A", "publish", topic="/chat", msg={"data": "me"}),
        gets("A", "publish", topic="/chat", msg={"data": "me"}),
    ),
    exchange(
        "a latched message reaches who comes later",
        "advertise subscribe",
        sends("B", "advertise", topic="/chat", type="std_msgs/String", latch=True),
        _HELLO,
        _A_LISTENS,
        _A_HEARS,
    ),
    exchange(
        "a message that is not latched does not",
        "advertise subscribe",
        _B_SPEAKS,
        _HELLO,
        _A_LISTENS,
        nothing_before("A"),
    ),
    exchange(
        "fields that are left out get defaults",
        "publish",
        sends("A", "subscribe", topic="/cmd_vel", type="geometry_msgs/Twist"),
        sends("B", "advertise", topic="/cmd_vel", type="geometry_msgs/Twist"),
        sends("B", "publish", topic="/cmd_vel", msg={"linear": {"x": 1}}),
        gets(
            "A",
            "publish",
            msg={"linear": {"x": 1.0, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.0}},
        ),
    ),
    exchange(
        "a header that is left out gets the time",
        "publish",
        sends("A", "subscribe", topic="/goal", type="geometry_msgs/PoseStamped"),
        sends("B", "advertise", topic="/goal", type="geometry_msgs/PoseStamped"),
        sends("B", "publish", topic="/goal", msg={"pose": {"position": {"x": 2.5}}}),
        gets("A", "publish", msg={"header": {"stamp": {"sec": WHOLE, "nanosec": WHOLE}, "frame_id": ""}}),
    ),
    exchange(
        "times of ROS 1 are read, those of ROS 2 are written",
        "publish",
        sends("A", "subscribe", topic="/t", type="std_msgs/Header"),
        sends("B", "advertise", topic="/t", type="std_msgs/Header"),
        sends("B", "publish", topic="/t", msg={"stamp": {"secs": 7, "nsecs": 8}, "frame_id": "map"}),
        gets("A", "publish", msg={"stamp": {"sec": 7, "nanosec": 8}, "frame_id": "map"}),
    ),
    exchange(
        "the seq of ROS 1's headers is passed over",
        "publish",
        sends("A", "subscribe", topic="/t", type="std_msgs/Header"),
        sends("B", "advertise", topic="/t", type="std_msgs/Header"),
        sends("B", "publish", topic="/t", msg={"seq": 4, "stamp": {"sec": 7, "nanosec": 8}, "frame_id": "map"}),
        gets("A", "publish", msg={"stamp": {"sec": 7, "nanosec": 8}, "frame_id": "map"}),
    ),
    exchange(
        "a name without a slash is the same topic, and is answered as it was asked for",
        "subscribe publish",
        sends("A", "subscribe", topic="chat", type="std_msgs/String"),
        _B_SPEAKS,
        _HELLO,
        gets("A", "publish", topic="chat", msg={"data": "hello"}),
    ),
    exchange(
        "bytes are base64, lists of bytes are read too",
        "publish",
        sends("A", "subscribe", topic="/image", type="sensor_msgs/CompressedImage"),
        sends("B", "advertise", topic="/image", type="sensor_msgs/CompressedImage"),
        sends("B", "publish", topic="/image", msg={"format": "png", "data": [0, 1, 255]}),
        gets("A", "publish", msg={"format": "png", "data": "AAH/"}),
        sends("B", "publish", topic="/image", msg={"format": "png", "data": "AAH/"}),
        gets("A", "publish", msg={"format": "png", "data": "AAH/"}),
    ),
    exchange(
        "null in numbers with a point is no number, and stays null",
        "publish",
        sends("A", "subscribe", topic="/scan", type="sensor_msgs/LaserScan"),
        sends("B", "advertise", topic="/scan", type="sensor_msgs/LaserScan"),
        sends("B", "publish", topic="/scan", msg={"ranges": [1.5, None], "range_max": None}),
        gets("A", "publish", msg={"ranges": [1.5, None], "range_max": None}),
    ),
    exchange(
        "NaN and Infinity, which are no JSON but come from Python, are read",
        "publish",
        sends("A", "subscribe", topic="/scan", type="sensor_msgs/LaserScan"),
        sends("B", "advertise", topic="/scan", type="sensor_msgs/LaserScan"),
        Sends(client="B", frame='{"op": "publish", "topic": "/scan", "msg": {"ranges": [NaN, Infinity, 2.0]}}'),
        gets("A", "publish", msg={"ranges": [None, None, 2.0]}),
    ),
    exchange(
        "64-bit numbers keep every bit",
        "publish",
        sends("A", "subscribe", topic="/n", type="std_msgs/Int64"),
        sends("B", "advertise", topic="/n", type="std_msgs/Int64"),
        sends("B", "publish", topic="/n", msg={"data": 9223372036854775807}),
        gets("A", "publish", msg={"data": 9223372036854775807}),
    ),
    exchange(
        "a subscriber may ask for CBOR",
        "subscribe",
        sends("A", "subscribe", topic="/scan", type="sensor_msgs/LaserScan", compression="cbor"),
        sends("B", "advertise", topic="/scan", type="sensor_msgs/LaserScan"),
        sends("B", "publish", topic="/scan", msg={"ranges": [1.5, 2.5]}),
        gets("A", "publish", encoding="cbor", topic="/scan", msg={"ranges": [1.5, 2.5]}),
    ),
    exchange(
        "or for the bytes of the message in CBOR",
        "subscribe",
        sends("A", "subscribe", topic="/n", type="std_msgs/Int32", compression="cbor-raw"),
        sends("B", "advertise", topic="/n", type="std_msgs/Int32"),
        sends("B", "publish", topic="/n", msg={"data": 5}),
        gets(
            "A",
            "publish",
            encoding="cbor",
            msg={"secs": WHOLE, "nsecs": WHOLE, "bytes": b"\x00\x01\x00\x00\x05\x00\x00\x00"},
        ),
    ),
    exchange(
        "or for an image",
        "subscribe png",
        sends("A", "subscribe", topic="/chat", type="std_msgs/String", compression="png"),
        _B_SPEAKS,
        sends("B", "publish", topic="/chat", msg={"data": "Grüße"}),
        gets("A", "publish", encoding="png", topic="/chat", msg={"data": "Grüße"}),
    ),
    exchange(
        "or for small pieces",
        "subscribe fragment",
        sends("A", "subscribe", topic="/chat", type="std_msgs/String", fragment_size=20),
        _B_SPEAKS,
        _HELLO,
        gets("A", "publish", encoding="fragment", topic="/chat", msg={"data": "hello"}),
    ),
    exchange(
        "pieces from a client are put together in any order",
        "fragment",
        _A_LISTENS,
        _B_SPEAKS,
        *(
            sends("B", "fragment", id="f1", data=part.data, num=part.num, total=part.total)
            for part in reversed(split('{"op":"publish","topic":"/chat","msg":{"data":"hello"}}', 20, "f1"))
        ),
        _A_HEARS,
    ),
    exchange(
        "a subscription ends by its id, the others go on",
        "unsubscribe",
        _A_LISTENS,
        sends("A", "subscribe", topic="/chat", id="s2"),
        sends("A", "unsubscribe", topic="/chat", id="s1"),
        _B_SPEAKS,
        _HELLO,
        _A_HEARS,
    ),
    exchange(
        "without an id all of them end",
        "unsubscribe",
        _A_LISTENS,
        sends("A", "subscribe", topic="/chat", id="s2"),
        sends("A", "unsubscribe", topic="/chat"),
        _B_SPEAKS,
        _HELLO,
        nothing_before("A"),
    ),
    exchange(
        "several subscriptions of a client bring each message once",
        "subscribe",
        _A_LISTENS,
        sends("A", "subscribe", topic="/chat", id="s2"),
        _B_SPEAKS,
        _HELLO,
        _A_HEARS,
        nothing_before("A"),
    ),
    exchange(
        "a topic stays while another client advertises it",
        "unadvertise",
        _A_LISTENS,
        _B_SPEAKS,
        sends("C", "advertise", topic="/chat", type="std_msgs/String"),
        sends("B", "unadvertise", topic="/chat", id="a1"),
        sends("C", "publish", topic="/chat", msg={"data": "hello"}),
        _A_HEARS,
    ),
    wrong("a type that does not exist", "advertise", sends("B", "advertise", topic="/x", type="no/Such", id="a1"),
           is_told("B", "no/Such", id="a1")),
    wrong("another type than the topic has", "advertise", _B_SPEAKS,
           sends("C", "advertise", topic="/chat", type="std_msgs/Int32", id="a2"),
           is_told("C", "/chat", "std_msgs", id="a2")),
    wrong("a subscription of another type", "subscribe", _B_SPEAKS,
           sends("A", "subscribe", topic="/chat", type="std_msgs/Int32", id="s1"),
           is_told("A", "/chat", id="s1")),
    wrong("a topic of unknown type", "subscribe", sends("A", "subscribe", topic="/nothing", id="s1"),
           is_told("A", "/nothing", id="s1")),
    wrong("a topic that does not exist", "publish", sends("B", "publish", topic="/nothing", msg={}, id="p1"),
           is_told("B", "/nothing", id="p1")),
    wrong("a field that does not exist", "publish", _A_LISTENS, _B_SPEAKS,
           sends("B", "publish", topic="/chat", msg={"text": "x"}, id="p1"), is_told("B", "text", id="p1"),
           nothing_before("A")),
    wrong("a value of the wrong type", "publish", _A_LISTENS, _B_SPEAKS,
           sends("B", "publish", topic="/chat", msg={"data": 7}, id="p1"), is_told("B", "data", "7", id="p1"),
           nothing_before("A")),
    wrong("a number out of range", "publish", sends("B", "advertise", topic="/n", type="std_msgs/UInt8"),
           sends("B", "publish", topic="/n", msg={"data": 300}, id="p1"), is_told("B", "data", "300", id="p1")),
    wrong("a message that is no object", "publish", _B_SPEAKS, sends("B", "publish", topic="/chat", msg=[1], id="p1"),
           is_told("B", "msg", id="p1")),
    wrong("an unknown compression", "subscribe",
           sends("A", "subscribe", topic="/chat", type="std_msgs/String", compression="zip", id="s1"),
           is_told("A", "compression", "zip", id="s1")),
    wrong("no topic", "unsubscribe", sends("A", "unsubscribe", id="s1"), is_told("A", "topic", id="s1")),
    wrong("no type", "advertise", sends("B", "advertise", topic="/x", id="a1"), is_told("B", "type", id="a1")),
    wrong("no topic", "unadvertise", sends("B", "unadvertise", id="a1"), is_told("B", "topic", id="a1")),
    wrong("a topic that the client does not advertise", "unadvertise",
           sends("B", "unadvertise", topic="/chat", id="a1"),
           gets("B", "status", level=Like(lambda v: v in ("warning", "error"), "warning or error"), id="a1")),
)  # fmt: skip

_SESSION = (
    exchange("who does not need to say who it is may", "auth",
              sends("A", "auth", mac="", client="a", dest="b", rand="r", t=0, level="", end=0), nothing_before("A")),
    exchange("a client may ask for silence", "set_level", sends("A", "set_level", level="none"),
              sends("A", "unadvertise", topic="/x"), nothing_before("A")),
    exchange("a client may say something", "status", sends("A", "status", level="info", msg="hello"),
              nothing_before("A")),
    exchange("a text in an image", "png", _A_LISTENS, _B_SPEAKS,
              sends("B", "png", data=png_of('{"op":"publish","topic":"/chat","msg":{"data":"hello"}}')), _A_HEARS),
    wrong("an unknown level", "set_level", sends("A", "set_level", level="loud", id="l1"),
           is_told("A", "level", "loud", id="l1")),
    wrong("a level that is no text", "status", sends("A", "status", level=3, msg="x", id="l1"),
           is_told("A", "level", "3", id="l1")),
    wrong("half a signature", "auth", sends("A", "auth", mac="abc", id="l1"), is_told("A", "client", id="l1")),
    wrong("no operation", "status", Sends(client="A", fields={"id": "x", "topic": "/chat"}),
           is_told("A", "op", id="x"), nothing_before("A")),
    wrong("an unknown operation", "status", sends("A", "dance", id="x"), is_told("A", "dance", id="x"),
           nothing_before("A")),
    wrong("no JSON", "status", Sends(client="A", frame='{"op": "publish", '), is_told("A", "JSON"),
           nothing_before("A")),
    wrong("no object", "status", Sends(client="A", frame="[1, 2]"), is_told("A", "list"), nothing_before("A")),
    wrong("no CBOR", "status", Sends(client="A", frame=b"\xff\x00"), is_told("A", "CBOR"), nothing_before("A")),
    wrong("nested too deep", "status", Sends(client="A", frame='{"a":' * 200 + "1" + "}" * 200),
           is_told("A", "deep"), nothing_before("A")),
    wrong("a piece beyond the last", "fragment", sends("A", "fragment", id="f1", data="x", num=2, total=2),
           is_told("A", "num", id="f1")),
    wrong("pieces of different texts", "fragment", sends("A", "fragment", id="f1", data="x", num=0, total=2),
           sends("A", "fragment", id="f1", data="y", num=1, total=3), is_told("A", "total"), nothing_before("A")),
    wrong("pieces of no JSON", "fragment", sends("A", "fragment", id="f1", data="x", num=0, total=1),
           is_told("A", "JSON"), nothing_before("A")),
    wrong("no image", "png", sends("A", "png", data="AAAA"), is_told("A", "PNG"), nothing_before("A")),
    wrong("no base64", "png", sends("A", "png", data="!"), is_told("A", "base64"), nothing_before("A")),
)  # fmt: skip

EXCHANGES: tuple[Exchange, ...] = _TOPICS + SERVICE_EXCHANGES + ACTION_EXCHANGES + _SESSION
"""For a server; see above."""


FROM_SERVER: tuple[FromServer, ...] = (
    FromServer(name="a status", frame='{"op":"status","level":"warning","msg":"careful"}', problem=""),
    FromServer(name="no JSON", frame="{", problem="JSON"),
    FromServer(name="no object", frame="3", problem="object"),
    FromServer(name="no CBOR", frame=b"\xff", problem="CBOR"),
    FromServer(name="a tag that is no array", frame=bytes.fromhex("a1626f70c11a514b67b0"), problem="tag"),
    FromServer(name="half a typed array", frame=bytes.fromhex("a16178d85543010203"), problem="array"),
    FromServer(name="an unknown operation", frame='{"op":"dance"}', problem="dance"),
    FromServer(
        name="a reply to a call that there is not",
        frame='{"op":"service_response","service":"/lamp","id":"never","result":true,"values":{}}',
        problem="never",
    ),
    FromServer(
        name="a reply without an id", frame='{"op":"service_response","service":"/l","result":true}', problem="id"
    ),
    FromServer(
        name="a reply without result", frame='{"op":"service_response","service":"/l","id":"1"}', problem="result"
    ),
    FromServer(
        name="a message of a topic that nobody asked for",
        frame='{"op":"publish","topic":"/no","msg":{}}',
        problem="/no",
    ),
    FromServer(name="a message that is no object", frame='{"op":"publish","topic":"/no","msg":3}', problem="msg"),
    FromServer(
        name="feedback on a goal that there is not",
        frame='{"op":"action_feedback","action":"/count","id":"never","values":{}}',
        problem="never",
    ),
    FromServer(
        name="a result of a goal that there is not",
        frame='{"op":"action_result","action":"/count","id":"never","status":4,"result":true,"values":{}}',
        problem="never",
    ),
    FromServer(
        name="a status that there is not",
        frame='{"op":"action_result","action":"/count","id":"never","status":44,"result":true,"values":{}}',
        problem="status",
    ),
    FromServer(
        name="a call of a service that is not offered",
        frame='{"op":"call_service","service":"/none","id":"1","args":{}}',
        problem="/none",
    ),
    FromServer(
        name="a piece beyond the last", frame='{"op":"fragment","id":"f","data":"","num":1,"total":1}', problem="num"
    ),
    FromServer(name="no image", frame='{"op":"png","data":"AAAA"}', problem="PNG"),
)
"""For a client: after each of them it goes on as before."""
