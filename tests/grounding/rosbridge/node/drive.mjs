// Drives a server with npm's roslib; prints what it saw as one JSON object.
//
//     node drive.mjs ws://127.0.0.1:PORT

import { Action, Param, Ros, Service, Topic } from "roslib";

const WAIT_MS = 20000;

/** What `start(resolve, reject)` tells, or an error if it takes too long. */
function answer(what, start) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`${what}: no answer`)), WAIT_MS);
    const done = (then) => (value) => (clearTimeout(timer), then(value));
    start(done(resolve), done((problem) => reject(new Error(`${what}: ${problem}`))));
  });
}

async function rosapi(ros) {
  const laserType = await answer("service type", (ok, no) => ros.getServiceType("/amigo_1/laser", ok, no));
  const message = await answer("details", (ok, no) => ros.getMessageDetails("geometry_msgs/Pose", ok, no));
  const topics = await answer("topics", (ok, no) => ros.getTopics(ok, no));
  const raw = await answer("raw types", (ok, no) => ros.getTopicsAndRawTypes(ok, no));
  return {
    rosout: topics.topics.includes("/rosout") && raw.typedefs_full_text.some((text) => text.includes("string msg")),
    scanType: await answer("topic type", (ok, no) => ros.getTopicType("/amigo_1/scan", ok, no)),
    lasers: await answer("services", (ok, no) => ros.getServicesForType(laserType, ok, no)),
    actions: await answer("actions", (ok, no) => ros.getActionServers(ok, no)),
    decoded: ros.decodeTypeDefs(message),
  };
}

async function services(ros) {
  const call = (name, type, request) =>
    answer(name, (ok, no) => new Service({ ros, name, serviceType: type }).callService(request, ok, no, 10));
  const laser = await call("/amigo_1/laser", "concertmaster_msgs/Laser", {});
  const base = await call("/amigo_1/base", "concertmaster_msgs/Base", { velocity: { linear: { x: 0.2 } } });
  const problem = await call("/none", "std_srvs/Empty", {}).catch((error) => error.message);
  return { ranges: laser.scan.ranges.length, frame: base.odometry.header.frame_id, problem };
}

async function provided(ros, other) {
  const lamp = new Service({ ros, name: "/lamp", serviceType: "std_srvs/SetBool" });
  await lamp.advertise((request, response) => {
    response.success = request.data;
    response.message = "done";
    return true;
  });
  const caller = new Service({ ros: other, name: "/lamp", serviceType: "std_srvs/SetBool" });
  const poll = (ok) => other.getServices((names) => (names.includes("/lamp") ? ok() : poll(ok)));
  await answer("advertised", poll);
  return answer("lamp", (ok, no) => caller.callService({ data: true }, ok, no));
}

async function topics(ros) {
  const heard = {};
  for (const compression of ["none", "png", "cbor"]) {
    const scan = new Topic({ ros, name: "/amigo_1/scan", messageType: "sensor_msgs/LaserScan", compression });
    const message = await answer(compression, (ok) => scan.subscribe(ok));
    scan.unsubscribe();
    heard[compression] = [message.ranges.length, message.ranges.constructor.name];
  }
  const chatter = new Topic({ ros, name: "/chatter", messageType: "std_msgs/String" });
  const said = answer("chatter", (ok) => chatter.subscribe(ok));
  await chatter.publish({ data: "Grüße" });
  heard.said = (await said).data;
  chatter.unsubscribe();
  chatter.unadvertise();
  return heard;
}

async function actions(ros) {
  const fibonacci = new Action({ ros, name: "/fibonacci", actionType: "example_interfaces/action/Fibonacci" });
  let fed = 0;
  const done = await answer("goal", (ok, no) => fibonacci.sendGoal({ order: 4 }, ok, () => (fed += 1), no));
  // roslib tells both as failures
  const canceled = await answer("cancel", (ok, no) => {
    const id = fibonacci.sendGoal({ order: 10000 }, no, () => fibonacci.cancelGoal(id), ok);
  });
  const refused = await answer("refusal", (ok, no) => fibonacci.sendGoal({ order: -1 }, no, undefined, ok));
  return { done, fed, canceled: String(canceled), refused: String(refused) };
}

async function navigation(ros) {
  const actionType = "nav2_msgs/action/NavigateToPose";
  const action = new Action({ ros, name: "/amigo_1/navigate_to_pose", actionType });
  const goal = (x) => {
    const pose = { position: { x, y: 1.5, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };
    return { pose: { header: { frame_id: "map" }, pose }, behavior_tree: "" };
  };
  let remaining = 0;
  const fed = (feedback) => (remaining = feedback.distance_remaining);
  const done = await answer("drive", (ok, no) => action.sendGoal(goal(1.6), ok, fed, no));
  const canceled = await answer("stop", (ok, no) => {
    const id = action.sendGoal(goal(4), no, () => action.cancelGoal(id), ok);
  });
  return { done, remaining, canceled: String(canceled) };
}

async function params(ros) {
  const speed = new Param({ ros, name: "/speed" });
  await answer("set", (ok, no) => speed.set({ mps: 0.5 }, ok, no));
  const value = await answer("get", (ok, no) => speed.get(ok, no));
  await answer("delete", (ok, no) => speed.delete(ok, no));
  const names = await answer("params", (ok, no) => ros.getParams(ok, no));
  return [value, names.includes("/speed")];
}

const [ros, other] = [new Ros(), new Ros()];
for (const one of [ros, other]) {
  await answer("connect", (ok, no) => {
    one.on("connection", ok);
    one.on("error", no);
    one.connect(process.argv[2]);
  });
}
const saw = {
  rosapi: await rosapi(ros),
  services: await services(ros),
  provided: await provided(ros, other),
  topics: await topics(ros),
  actions: await actions(ros),
  navigation: await navigation(ros),
  params: await params(ros),
};
ros.close();
other.close();
console.log(JSON.stringify(saw));
