// Generated from palpate/viewer/messages.py; change it there, then
//   python -m palpate.viewer.messages > src/palpate/viewer/client/src/messages.ts

export type Vec3 = [number, number, number];

export const PROTOCOL = 3;

/** The real-time process as the server sees it. */
export const Loop = {
  RUNNING: 0,
  FROZEN: 1,
  ENDED: 2,
} as const;

/** Who holds the hand, from one page's point of view. */
export const Hold = {
  FREE: 0,
  YOURS: 1,
  ANOTHER: 2,
} as const;

/** A named interval. */
export interface RangeInfo {
  name: string;
  low: number;
  high: number;
  unit: string;
}

/** A quantity that deforms or colours a body, and its range over all that is shown. */
export interface FieldInfo {
  name: string;
  unit: string;
  low: number;
  high: number;
  components: number;
  modes: number;
}

/** A body held at one node and drawn as a line. */
export interface Line {
  rest: Vec3[];
  touch_node: number;
  nodes_of_interest: number[];
  travel: Vec3[];
}

/** A state in words and figures. */
export interface StepInfo {
  label: string;
  figures: Record<string, unknown>;
}

/** A touchable body and its loop, once per connection, server to page. */
export interface Hello {
  protocol: number;
  name: string;
  inputs: RangeInfo[];
  parameters: RangeInfo[];
  holds: boolean;
  radius: number;
  radius_parameter: number;
  deepest: number;
  force_max: number;
  stiffness_max: number;
  centre: Vec3;
  line: Line | null;
  fields: FieldInfo[];
  remembers: string;
  scale: number;
  workspace: number;
  max_force: number;
  rate: number;
  faults: string[];
  meta: Record<string, unknown>;
}

/** An event in plain words, server to page. */
export interface Notice {
  what: string;
  why: string;
  fix: string;
}

/** A body to look at, server to page. */
export interface Shown {
  protocol: number;
  name: string;
  fields: FieldInfo[];
  steps: StepInfo[];
  reach: number;
}

export function isHello(message: { kind: string }): message is Hello & { kind: string } {
  return message.kind === "Hello";
}

export function isNotice(message: { kind: string }): message is Notice & { kind: string } {
  return message.kind === "Notice";
}

export function isShown(message: { kind: string }): message is Shown & { kind: string } {
  return message.kind === "Shown";
}

export const FRAME = 1;

/** One picture of the loop and of a touched body, server to page. */
export interface Frame {
  /** counts the loop's ticks */
  tick: number;
  /** s, when the frame was composed, on the loop's clock */
  time: number;
  /** ms, page clock: `sent` of the last Hand that this page sent */
  echo: number;
  /** m, the probe's centre, or the hand's offset from what it holds at rest */
  position: Vec3;
  /** N, on the hand */
  force: Vec3;
  /** Hz, ticks per second achieved */
  rate: number;
  /** s, the latest tick since the frame before, to a quarter of itself */
  lateness: number;
  /** s, median since the start, 0 below a microsecond */
  lateness_p50: number;
  /** s, 99th percentile since the start */
  lateness_p99: number;
  /** s, largest since the start */
  lateness_max: number;
  /** s, median CPU time of one tick */
  work_p50: number;
  /** faults since the start, stalls apart */
  faults: number;
  /** code of this tick's fault, 0 for none; words in Hello.faults */
  fault: number;
  /** code of the latest fault */
  last_fault: number;
  /** a Loop */
  loop: number;
  /** a Hold */
  hold: number;
  /** the hand is within the trained range */
  inside: boolean;
  /** the force limit acted */
  clamped: boolean;
  /** a hand holds the body */
  grabbed: boolean;
  /** the input is older than the loop allows */
  stalled: boolean;
  /** m, where a line's node is, as an offset from rest; else the foot of the touch at rest */
  contact: Vec3;
  /** of the surface there; zero where nothing touches */
  normal: Vec3;
  /** m, of the probe in the surface at rest, negative in the air; or how far displaced */
  depth: number;
  /** N/m, along the force; 0 where unknown */
  stiffness: number;
  /** standard deviation of the force relative to it, NaN where unknown */
  deviation: number;
  /** m, depth of the shape drawn: after release it goes back to 0 */
  drawn: number;
  /** current values of the parameters */
  parameters: Float32Array;
  /** m, x y z of each of a line's nodes, as an offset from rest */
  displacement: Float32Array;
  /** for each field its modes' coefficients and its local mode's profile */
  coefficients: Float32Array;
  /** m, how deep it stays pressed at each of Surface.printable; empty if nowhere */
  prints: Float32Array;
}

export function encodeFrame(m: Frame): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(125 + 4 + 4 * m.parameters.length + 4 + 4 * m.displacement.length + 4 + 4 * m.coefficients.length + 4 + 4 * m.prints.length));
  view.setUint8(0, 1);
  view.setFloat64(1, m.tick, true);
  view.setFloat64(9, m.time, true);
  view.setFloat64(17, m.echo, true);
  view.setFloat32(25, m.position[0], true);
  view.setFloat32(29, m.position[1], true);
  view.setFloat32(33, m.position[2], true);
  view.setFloat32(37, m.force[0], true);
  view.setFloat32(41, m.force[1], true);
  view.setFloat32(45, m.force[2], true);
  view.setFloat32(49, m.rate, true);
  view.setFloat32(53, m.lateness, true);
  view.setFloat32(57, m.lateness_p50, true);
  view.setFloat32(61, m.lateness_p99, true);
  view.setFloat32(65, m.lateness_max, true);
  view.setFloat32(69, m.work_p50, true);
  view.setUint32(73, m.faults, true);
  view.setUint8(77, m.fault);
  view.setUint8(78, m.last_fault);
  view.setUint8(79, m.loop);
  view.setUint8(80, m.hold);
  view.setUint8(81, m.inside ? 1 : 0);
  view.setUint8(82, m.clamped ? 1 : 0);
  view.setUint8(83, m.grabbed ? 1 : 0);
  view.setUint8(84, m.stalled ? 1 : 0);
  view.setFloat32(85, m.contact[0], true);
  view.setFloat32(89, m.contact[1], true);
  view.setFloat32(93, m.contact[2], true);
  view.setFloat32(97, m.normal[0], true);
  view.setFloat32(101, m.normal[1], true);
  view.setFloat32(105, m.normal[2], true);
  view.setFloat32(109, m.depth, true);
  view.setFloat32(113, m.stiffness, true);
  view.setFloat32(117, m.deviation, true);
  view.setFloat32(121, m.drawn, true);
  let at = 125;
  view.setUint32(at, m.parameters.length, true);
  at += 4;
  for (const value of m.parameters) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.displacement.length, true);
  at += 4;
  for (const value of m.displacement) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.coefficients.length, true);
  at += 4;
  for (const value of m.coefficients) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.prints.length, true);
  at += 4;
  for (const value of m.prints) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  return view.buffer;
}

export function decodeFrame(buffer: ArrayBuffer): Frame {
  const view = new DataView(buffer);
  const parametersAt = 125;
  const parametersEnd = parametersAt + 4 + 4 * view.getUint32(parametersAt, true);
  const displacementAt = parametersEnd;
  const displacementEnd = displacementAt + 4 + 4 * view.getUint32(displacementAt, true);
  const coefficientsAt = displacementEnd;
  const coefficientsEnd = coefficientsAt + 4 + 4 * view.getUint32(coefficientsAt, true);
  const printsAt = coefficientsEnd;
  const printsEnd = printsAt + 4 + 4 * view.getUint32(printsAt, true);
  return {
    tick: view.getFloat64(1, true),
    time: view.getFloat64(9, true),
    echo: view.getFloat64(17, true),
    position: [view.getFloat32(25, true), view.getFloat32(29, true), view.getFloat32(33, true)],
    force: [view.getFloat32(37, true), view.getFloat32(41, true), view.getFloat32(45, true)],
    rate: view.getFloat32(49, true),
    lateness: view.getFloat32(53, true),
    lateness_p50: view.getFloat32(57, true),
    lateness_p99: view.getFloat32(61, true),
    lateness_max: view.getFloat32(65, true),
    work_p50: view.getFloat32(69, true),
    faults: view.getUint32(73, true),
    fault: view.getUint8(77),
    last_fault: view.getUint8(78),
    loop: view.getUint8(79),
    hold: view.getUint8(80),
    inside: view.getUint8(81) !== 0,
    clamped: view.getUint8(82) !== 0,
    grabbed: view.getUint8(83) !== 0,
    stalled: view.getUint8(84) !== 0,
    contact: [view.getFloat32(85, true), view.getFloat32(89, true), view.getFloat32(93, true)],
    normal: [view.getFloat32(97, true), view.getFloat32(101, true), view.getFloat32(105, true)],
    depth: view.getFloat32(109, true),
    stiffness: view.getFloat32(113, true),
    deviation: view.getFloat32(117, true),
    drawn: view.getFloat32(121, true),
    parameters: new Float32Array(buffer.slice(parametersAt + 4, parametersEnd)),
    displacement: new Float32Array(buffer.slice(displacementAt + 4, displacementEnd)),
    coefficients: new Float32Array(buffer.slice(coefficientsAt + 4, coefficientsEnd)),
    prints: new Float32Array(buffer.slice(printsAt + 4, printsEnd)),
  };
}

export const HAND = 2;

/** The hand's place and grip, page to server; also the heartbeat. */
export interface Hand {
  /** ms, page clock when this was sent */
  sent: number;
  /** s, the longest time to the next of these */
  period: number;
  /** m, the hand in device coordinates */
  target: Vec3;
  /** a hand holds the body */
  grabbed: boolean;
  /** the page is in the background */
  hidden: boolean;
  /** wanted values of the parameters */
  parameters: Float32Array;
}

export function encodeHand(m: Hand): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(43 + 4 + 4 * m.parameters.length));
  view.setUint8(0, 2);
  view.setFloat64(1, m.sent, true);
  view.setFloat64(9, m.period, true);
  view.setFloat64(17, m.target[0], true);
  view.setFloat64(25, m.target[1], true);
  view.setFloat64(33, m.target[2], true);
  view.setUint8(41, m.grabbed ? 1 : 0);
  view.setUint8(42, m.hidden ? 1 : 0);
  let at = 43;
  view.setUint32(at, m.parameters.length, true);
  at += 4;
  for (const value of m.parameters) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  return view.buffer;
}

export function decodeHand(buffer: ArrayBuffer): Hand {
  const view = new DataView(buffer);
  const parametersAt = 43;
  const parametersEnd = parametersAt + 4 + 4 * view.getUint32(parametersAt, true);
  return {
    sent: view.getFloat64(1, true),
    period: view.getFloat64(9, true),
    target: [view.getFloat64(17, true), view.getFloat64(25, true), view.getFloat64(33, true)],
    grabbed: view.getUint8(41) !== 0,
    hidden: view.getUint8(42) !== 0,
    parameters: new Float32Array(buffer.slice(parametersAt + 4, parametersEnd)),
  };
}

export const CREDIT = 3;

/** Leave to send more frames, page to server. */
export interface Credit {
  /** how many more */
  frames: number;
}

export function encodeCredit(m: Credit): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(3));
  view.setUint8(0, 3);
  view.setUint16(1, m.frames, true);
  return view.buffer;
}

export function decodeCredit(buffer: ArrayBuffer): Credit {
  const view = new DataView(buffer);
  return {
    frames: view.getUint16(1, true),
  };
}

export const SURFACE = 4;

/** The surface of a body at rest, server to page. Points are split along sharp edges. */
export interface Surface {
  /** m, x y z of each point */
  rest: Float32Array;
  /** three points each; exact up to 16 million */
  triangles: Float32Array;
  /** two points for each sharp edge */
  creases: Float32Array;
  /** two points for each edge around the fixed surfaces */
  fixed: Float32Array;
  /** 1 for each triangle that a hand may touch, else 0 */
  touchable: Float32Array;
  /** points that keep prints; none where the body keeps none */
  printable: Float32Array;
  /** outward unit normal of each of them */
  normals: Float32Array;
}

export function encodeSurface(m: Surface): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(1 + 4 + 4 * m.rest.length + 4 + 4 * m.triangles.length + 4 + 4 * m.creases.length + 4 + 4 * m.fixed.length + 4 + 4 * m.touchable.length + 4 + 4 * m.printable.length + 4 + 4 * m.normals.length));
  view.setUint8(0, 4);
  let at = 1;
  view.setUint32(at, m.rest.length, true);
  at += 4;
  for (const value of m.rest) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.triangles.length, true);
  at += 4;
  for (const value of m.triangles) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.creases.length, true);
  at += 4;
  for (const value of m.creases) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.fixed.length, true);
  at += 4;
  for (const value of m.fixed) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.touchable.length, true);
  at += 4;
  for (const value of m.touchable) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.printable.length, true);
  at += 4;
  for (const value of m.printable) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.normals.length, true);
  at += 4;
  for (const value of m.normals) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  return view.buffer;
}

export function decodeSurface(buffer: ArrayBuffer): Surface {
  const view = new DataView(buffer);
  const restAt = 1;
  const restEnd = restAt + 4 + 4 * view.getUint32(restAt, true);
  const trianglesAt = restEnd;
  const trianglesEnd = trianglesAt + 4 + 4 * view.getUint32(trianglesAt, true);
  const creasesAt = trianglesEnd;
  const creasesEnd = creasesAt + 4 + 4 * view.getUint32(creasesAt, true);
  const fixedAt = creasesEnd;
  const fixedEnd = fixedAt + 4 + 4 * view.getUint32(fixedAt, true);
  const touchableAt = fixedEnd;
  const touchableEnd = touchableAt + 4 + 4 * view.getUint32(touchableAt, true);
  const printableAt = touchableEnd;
  const printableEnd = printableAt + 4 + 4 * view.getUint32(printableAt, true);
  const normalsAt = printableEnd;
  const normalsEnd = normalsAt + 4 + 4 * view.getUint32(normalsAt, true);
  return {
    rest: new Float32Array(buffer.slice(restAt + 4, restEnd)),
    triangles: new Float32Array(buffer.slice(trianglesAt + 4, trianglesEnd)),
    creases: new Float32Array(buffer.slice(creasesAt + 4, creasesEnd)),
    fixed: new Float32Array(buffer.slice(fixedAt + 4, fixedEnd)),
    touchable: new Float32Array(buffer.slice(touchableAt + 4, touchableEnd)),
    printable: new Float32Array(buffer.slice(printableAt + 4, printableEnd)),
    normals: new Float32Array(buffer.slice(normalsAt + 4, normalsEnd)),
  };
}

export const STEP = 5;

/** One state of a body, server to page. */
export interface Step {
  /** place in Shown.steps */
  index: number;
  /** a probe touches the body */
  probed: boolean;
  /** m, of the probe */
  centre: Vec3;
  /** m, of the probe */
  radius: number;
  /** m, x y z of each point of the surface */
  displacement: Float32Array;
  /** all points' values of the first of Shown.fields, then the next */
  values: Float32Array;
}

export function encodeStep(m: Step): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(22 + 4 + 4 * m.displacement.length + 4 + 4 * m.values.length));
  view.setUint8(0, 5);
  view.setUint32(1, m.index, true);
  view.setUint8(5, m.probed ? 1 : 0);
  view.setFloat32(6, m.centre[0], true);
  view.setFloat32(10, m.centre[1], true);
  view.setFloat32(14, m.centre[2], true);
  view.setFloat32(18, m.radius, true);
  let at = 22;
  view.setUint32(at, m.displacement.length, true);
  at += 4;
  for (const value of m.displacement) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.values.length, true);
  at += 4;
  for (const value of m.values) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  return view.buffer;
}

export function decodeStep(buffer: ArrayBuffer): Step {
  const view = new DataView(buffer);
  const displacementAt = 22;
  const displacementEnd = displacementAt + 4 + 4 * view.getUint32(displacementAt, true);
  const valuesAt = displacementEnd;
  const valuesEnd = valuesAt + 4 + 4 * view.getUint32(valuesAt, true);
  return {
    index: view.getUint32(1, true),
    probed: view.getUint8(5) !== 0,
    centre: [view.getFloat32(6, true), view.getFloat32(10, true), view.getFloat32(14, true)],
    radius: view.getFloat32(18, true),
    displacement: new Float32Array(buffer.slice(displacementAt + 4, displacementEnd)),
    values: new Float32Array(buffer.slice(valuesAt + 4, valuesEnd)),
  };
}

export const MODES = 6;

/** A field on a Surface's points, server to page: rest + coefficients · modes + the local mode of a profile. */
export interface Modes {
  /** m, of the local mode from its foot; 0 for none */
  reach: number;
  /** splines of the distance from the foot; 0 for none */
  rows: number;
  /** components of each point */
  rest: Float32Array;
  /** the same of each mode */
  modes: Float32Array;
  /** points that the local mode may move */
  touched: Float32Array;
}

export function encodeModes(m: Modes): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(7 + 4 + 4 * m.rest.length + 4 + 4 * m.modes.length + 4 + 4 * m.touched.length));
  view.setUint8(0, 6);
  view.setFloat32(1, m.reach, true);
  view.setUint16(5, m.rows, true);
  let at = 7;
  view.setUint32(at, m.rest.length, true);
  at += 4;
  for (const value of m.rest) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.modes.length, true);
  at += 4;
  for (const value of m.modes) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  view.setUint32(at, m.touched.length, true);
  at += 4;
  for (const value of m.touched) {
    view.setFloat32(at, value, true);
    at += 4;
  }
  return view.buffer;
}

export function decodeModes(buffer: ArrayBuffer): Modes {
  const view = new DataView(buffer);
  const restAt = 7;
  const restEnd = restAt + 4 + 4 * view.getUint32(restAt, true);
  const modesAt = restEnd;
  const modesEnd = modesAt + 4 + 4 * view.getUint32(modesAt, true);
  const touchedAt = modesEnd;
  const touchedEnd = touchedAt + 4 + 4 * view.getUint32(touchedAt, true);
  return {
    reach: view.getFloat32(1, true),
    rows: view.getUint16(5, true),
    rest: new Float32Array(buffer.slice(restAt + 4, restEnd)),
    modes: new Float32Array(buffer.slice(modesAt + 4, modesEnd)),
    touched: new Float32Array(buffer.slice(touchedAt + 4, touchedEnd)),
  };
}
