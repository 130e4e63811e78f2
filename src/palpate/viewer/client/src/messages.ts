// Generated from palpate/viewer/messages.py, part_messages.py and exam_messages.py; change it there, then
//   python -m palpate.viewer.messages > src/palpate/viewer/client/src/messages.ts

import { decode, encode } from "./wire";
import type { Layout } from "./wire";

export type Vec3 = [number, number, number];

export const PROTOCOL = 11;

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

/** The role of a triangle of a part's surface. */
export const Role = {
  FREE: 0,
  HELD: 1,
  TOUCHED: 2,
} as const;

/** A named interval. */
export interface RangeInfo {
  name: string;
  words: string;
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

/** The tool that presses a body: its closed surface around its place, in the body's axes. */
export interface DrawnTool {
  words: string;
  centre: Vec3;
  shift: Vec3;
  points: number[];
  normals: number[];
  triangles: number[];
  turns: [number, number, number];
  opening: number;
  along: Vec3;
  first: number;
}

/** A state in words and figures. */
export interface StepInfo {
  label: string;
  figures: Record<string, unknown>;
}

/** A face of a part: its name, its area in m², and the middle of it in m. */
export interface FaceInfo {
  name: string;
  area: number;
  centre: Vec3;
}

/** A material that can be asked for by name, with what there is to say of it in a few words. */
export interface MaterialInfo {
  name: string;
  about: string;
  kind: string;
  young: string;
  poisson: string;
}

/** A size of a tool that can be chosen: its name in `StartWish`, what it is, and a text with its unit. */
export interface SizeInfo {
  name: string;
  words: string;
  value: string;
}

/** Something that can press a part: a ball, or a tool with sizes that suit the part. */
export interface ToolInfo {
  name: string;
  about: string;
  sizes: SizeInfo[];
}

/** A region of a part of several, and its material as it can be typed. */
export interface RegionInfo {
  name: string;
  material: string;
}

/** A place that a person has marked on the skin, m, or one that practice shows. */
export interface ExamMark {
  number: number;
  place: Vec3;
  hardness: string;
  depth: string;
  answer: string;
}

/** An examination on this machine. */
export interface FormerExam {
  name: string;
  at: string;
  words: string;
  ended: boolean;
}

/** A touchable body and its loop, once per connection, server to page. */
export interface Hello {
  protocol: number;
  version: number;
  name: string;
  inputs: RangeInfo[];
  parameters: RangeInfo[];
  holds: boolean;
  radius: number;
  radius_parameter: number;
  tool: DrawnTool | null;
  twists: boolean;
  deepest: number;
  force_max: number;
  stiffness_max: number;
  centre: Vec3;
  line: Line | null;
  fields: FieldInfo[];
  pad: string;
  remembers: string;
  scale: number;
  workspace: number;
  max_force: number;
  rate: number;
  faults: string[];
  hand: string;
  device: string;
  meta: Record<string, unknown>;
}

/** A body to look at, server to page. */
export interface Shown {
  protocol: number;
  name: string;
  fields: FieldInfo[];
  steps: StepInfo[];
  reach: number;
  tool: DrawnTool | null;
}

/** An event in plain words, server to page. */
export interface Notice {
  what: string;
  why: string;
  fix: string;
}

/** The recording of the touch, server to page. */
export interface Recording {
  active: boolean;
  file: string;
  seconds: number;
  size: number;
  lost: number;
  problem: string;
}

/** The reason why there is no force, or lately was none, server to page. */
export interface Reason {
  now: string;
  stopped: boolean;
  dropped: string;
  ago: number;
}

/** Cautions about what is felt on the device, such as of a body too stiff for its rate and delay, server to page. */
export interface Feel {
  body: number;
  limit: number;
  felt: number;
  override: boolean;
  words: string;
}

/** The stage of the work on a part, server to page. */
export interface PartNews {
  protocol: number;
  name: string;
  stage: string;
  words: string;
  version: number;
  part: number;
  wrap: string;
}

/** A part and the choices that were made for it, server to page. */
export interface PartFacts {
  file: string;
  unit: string;
  units: string[];
  size: Vec3;
  faces: FaceInfo[];
  whole: boolean;
  materials: MaterialInfo[];
  laws: string[];
  tools: ToolInfo[];
  regions: RegionInfo[];
  choices: Record<string, unknown>;
  notes: string[];
}

/** The choices with which the solves shall begin, page to server. Quantities are texts with units. */
export interface StartWish {
  material: string;
  law: string;
  young: string;
  poisson: string;
  radius: string;
  depth: string;
  trial: boolean;
  tool: string;
  sizes: Record<string, unknown>;
  regions: Record<string, unknown>;
}

/** The wish that the numbers of the file are taken in another unit, page to server. */
export interface UnitWish {
  unit: string;
}

/** The wish that a closed surface is wrapped around a refused one, page to server. */
export interface WrapWish {
  size: string;
}

/** The answer to a wish, server to page: problems in sentences, or none where all fits. */
export interface Answer {
  problem: string;
  fields: Record<string, unknown> | null;
  trial: boolean;
  tool: DrawnTool | null;
}

/** The state of solving and learning, server to page. */
export interface LearningProgress {
  phase: string;
  solves: number;
  target: number;
  error_median: number | null;
  error_p95: number | null;
  trial: string;
  places: Vec3[];
  seconds: number;
  report: boolean;
  remaining: number | null;
  share: number;
  painted_area: number | null;
  trained_area: number | null;
}

/** The state of the page of an examination, server to page. */
export interface ExamNews {
  protocol: number;
  title: string;
  words: string;
  stage: string;
  notice: string;
  elapsed: number;
  marks: ExamMark[];
  lumps: ExamMark[];
  former: FormerExam[];
  score: string;
}

/** The wish of a person who examines, page to server. */
export interface ExamWish {
  wish: string;
  number: number;
  place: Vec3;
  hardness: string;
  depth: string;
  name: string;
}

export function isHello(message: { kind: string }): message is Hello & { kind: string } {
  return message.kind === "Hello";
}

export function isShown(message: { kind: string }): message is Shown & { kind: string } {
  return message.kind === "Shown";
}

export function isNotice(message: { kind: string }): message is Notice & { kind: string } {
  return message.kind === "Notice";
}

export function isRecording(message: { kind: string }): message is Recording & { kind: string } {
  return message.kind === "Recording";
}

export function isReason(message: { kind: string }): message is Reason & { kind: string } {
  return message.kind === "Reason";
}

export function isFeel(message: { kind: string }): message is Feel & { kind: string } {
  return message.kind === "Feel";
}

export function isPartNews(message: { kind: string }): message is PartNews & { kind: string } {
  return message.kind === "PartNews";
}

export function isPartFacts(message: { kind: string }): message is PartFacts & { kind: string } {
  return message.kind === "PartFacts";
}

export function isStartWish(message: { kind: string }): message is StartWish & { kind: string } {
  return message.kind === "StartWish";
}

export function isUnitWish(message: { kind: string }): message is UnitWish & { kind: string } {
  return message.kind === "UnitWish";
}

export function isWrapWish(message: { kind: string }): message is WrapWish & { kind: string } {
  return message.kind === "WrapWish";
}

export function isAnswer(message: { kind: string }): message is Answer & { kind: string } {
  return message.kind === "Answer";
}

export function isLearningProgress(message: { kind: string }): message is LearningProgress & { kind: string } {
  return message.kind === "LearningProgress";
}

export function isExamNews(message: { kind: string }): message is ExamNews & { kind: string } {
  return message.kind === "ExamNews";
}

export function isExamWish(message: { kind: string }): message is ExamWish & { kind: string } {
  return message.kind === "ExamWish";
}

export const FRAME = 1;

/** One picture of the loop and of a touched body, server to page. */
export interface Frame {
  /** of the body that this picture is drawn with, as in Hello */
  version: number;
  /** counts the loop's ticks */
  tick: number;
  /** s, when the frame was composed, on the loop's clock */
  time: number;
  /** ms, page clock: `sent` of the last Hand that this page sent */
  echo: number;
  /** m, the probe's centre or the tool's place, or the hand's offset from what it holds at rest */
  position: Vec3;
  /** N, on the hand */
  force: Vec3;
  /** N m, on a tool about its place; zero where none is told */
  torque: Vec3;
  /** N, with which the body pushes two jaws apart; NaN where it is unknown */
  effort: number;
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
  /** nobody touches, and the loop ticks more slowly, or did so just now */
  resting: boolean;
  /** the input is older than the loop allows */
  stalled: boolean;
  /** m, where a line's node is, as an offset from rest; else the contact point at rest */
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
  /** m, how deep it stays pressed at each of Surface.yielding; empty if nowhere */
  indentation: Float32Array;
}

const FRAME_LAYOUT: Layout = [
  ["version", "u16"],
  ["tick", "f64"],
  ["time", "f64"],
  ["echo", "f64"],
  ["position", "vec3"],
  ["force", "vec3"],
  ["torque", "vec3"],
  ["effort", "f32"],
  ["rate", "f32"],
  ["lateness", "f32"],
  ["lateness_p50", "f32"],
  ["lateness_p99", "f32"],
  ["lateness_max", "f32"],
  ["work_p50", "f32"],
  ["faults", "u32"],
  ["fault", "u8"],
  ["last_fault", "u8"],
  ["loop", "u8"],
  ["hold", "u8"],
  ["inside", "flag"],
  ["clamped", "flag"],
  ["grabbed", "flag"],
  ["resting", "flag"],
  ["stalled", "flag"],
  ["contact", "vec3"],
  ["normal", "vec3"],
  ["depth", "f32"],
  ["stiffness", "f32"],
  ["deviation", "f32"],
  ["drawn", "f32"],
  ["parameters", "floats"],
  ["displacement", "floats"],
  ["coefficients", "floats"],
  ["indentation", "floats"],
];

export const encodeFrame = (m: Frame): ArrayBuffer => encode(FRAME, FRAME_LAYOUT, m);
export const decodeFrame = (buffer: ArrayBuffer): Frame => decode<Frame>(FRAME_LAYOUT, buffer);

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

const HAND_LAYOUT: Layout = [
  ["sent", "f64"],
  ["period", "f64"],
  ["target", "vec3d"],
  ["grabbed", "flag"],
  ["hidden", "flag"],
  ["parameters", "floats"],
];

export const encodeHand = (m: Hand): ArrayBuffer => encode(HAND, HAND_LAYOUT, m);
export const decodeHand = (buffer: ArrayBuffer): Hand => decode<Hand>(HAND_LAYOUT, buffer);

export const CREDIT = 3;

/** Leave to send more frames, page to server. */
export interface Credit {
  /** how many more */
  frames: number;
}

const CREDIT_LAYOUT: Layout = [
  ["frames", "u16"],
];

export const encodeCredit = (m: Credit): ArrayBuffer => encode(CREDIT, CREDIT_LAYOUT, m);
export const decodeCredit = (buffer: ArrayBuffer): Credit => decode<Credit>(CREDIT_LAYOUT, buffer);

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
  /** points that keep indentations; none where the body keeps none */
  yielding: Float32Array;
  /** outward unit normal of each of them */
  normals: Float32Array;
}

const SURFACE_LAYOUT: Layout = [
  ["rest", "floats"],
  ["triangles", "floats"],
  ["creases", "floats"],
  ["fixed", "floats"],
  ["touchable", "floats"],
  ["yielding", "floats"],
  ["normals", "floats"],
];

export const encodeSurface = (m: Surface): ArrayBuffer => encode(SURFACE, SURFACE_LAYOUT, m);
export const decodeSurface = (buffer: ArrayBuffer): Surface => decode<Surface>(SURFACE_LAYOUT, buffer);

export const STEP = 5;

/** One state of a body, server to page. */
export interface Step {
  /** place in Shown.steps */
  index: number;
  /** a probe touches the body */
  probed: boolean;
  /** m, of the probe, or a tool's place */
  centre: Vec3;
  /** rad, rotation vector that turns a tool about its place, beside its own */
  turn: Vec3;
  /** m, of the probe */
  radius: number;
  /** m, distance of two jaws; 0 of one tool */
  opening: number;
  /** m, x y z of each point of the surface */
  displacement: Float32Array;
  /** all points' values of the first of Shown.fields, then the next */
  values: Float32Array;
}

const STEP_LAYOUT: Layout = [
  ["index", "u32"],
  ["probed", "flag"],
  ["centre", "vec3"],
  ["turn", "vec3"],
  ["radius", "f32"],
  ["opening", "f32"],
  ["displacement", "floats"],
  ["values", "floats"],
];

export const encodeStep = (m: Step): ArrayBuffer => encode(STEP, STEP_LAYOUT, m);
export const decodeStep = (buffer: ArrayBuffer): Step => decode<Step>(STEP_LAYOUT, buffer);

export const MODES = 6;

/** A field on a Surface's points, server to page: rest + coefficients · modes + the local mode of a profile. */
export interface Modes {
  /** m, of the local mode from the contact point; 0 for none */
  reach: number;
  /** splines of the distance from the contact point; 0 for none */
  rows: number;
  /** components of each point */
  rest: Float32Array;
  /** the same of each mode */
  modes: Float32Array;
  /** points that the local mode may move */
  touched: Float32Array;
  /** share of the local mode that each of them takes */
  shares: Float32Array;
}

const MODES_LAYOUT: Layout = [
  ["reach", "f32"],
  ["rows", "u16"],
  ["rest", "floats"],
  ["modes", "floats"],
  ["touched", "floats"],
  ["shares", "floats"],
];

export const encodeModes = (m: Modes): ArrayBuffer => encode(MODES, MODES_LAYOUT, m);
export const decodeModes = (buffer: ArrayBuffer): Modes => decode<Modes>(MODES_LAYOUT, buffer);

export const RECORDWISH = 7;

/** The wish to record the touch, page to server. */
export interface RecordWish {
  /** start one; otherwise stop it */
  wanted: boolean;
}

const RECORDWISH_LAYOUT: Layout = [
  ["wanted", "flag"],
];

export const encodeRecordWish = (m: RecordWish): ArrayBuffer => encode(RECORDWISH, RECORDWISH_LAYOUT, m);
export const decodeRecordWish = (buffer: ArrayBuffer): RecordWish => decode<RecordWish>(RECORDWISH_LAYOUT, buffer);

export const STOPWISH = 8;

/** A person's wish to end all force, or to end the stop, page to server. */
export interface StopWish {
  /** end all force; otherwise end the stop */
  stop: boolean;
}

const STOPWISH_LAYOUT: Layout = [
  ["stop", "flag"],
];

export const encodeStopWish = (m: StopWish): ArrayBuffer => encode(STOPWISH, STOPWISH_LAYOUT, m);
export const decodeStopWish = (buffer: ArrayBuffer): StopWish => decode<StopWish>(STOPWISH_LAYOUT, buffer);

export const PICKS = 9;

/** Triangles that were picked on a part's surface, page to server. */
export interface Picks {
  /** a Role, held or touched */
  role: number;
  /** the first piece of this role; others are added to it */
  first: boolean;
  /** indices into the part's triangles */
  triangles: Float32Array;
}

const PICKS_LAYOUT: Layout = [
  ["role", "u8"],
  ["first", "flag"],
  ["triangles", "floats"],
];

export const encodePicks = (m: Picks): ArrayBuffer => encode(PICKS, PICKS_LAYOUT, m);
export const decodePicks = (buffer: ArrayBuffer): Picks => decode<Picks>(PICKS_LAYOUT, buffer);

export const ENDWISH = 10;

/** The wish that no more solves begin, because the surrogate is good enough; page to server. */
export interface EndWish {
  /** always true */
  sure: boolean;
}

const ENDWISH_LAYOUT: Layout = [
  ["sure", "flag"],
];

export const encodeEndWish = (m: EndWish): ArrayBuffer => encode(ENDWISH, ENDWISH_LAYOUT, m);
export const decodeEndWish = (buffer: ArrayBuffer): EndWish => decode<EndWish>(ENDWISH_LAYOUT, buffer);

export const READY = 11;

/** The news that the page has the surface and fields of a version of the body, page to server. */
export interface Ready {
  /** of the body, as in Hello */
  version: number;
}

const READY_LAYOUT: Layout = [
  ["version", "u16"],
];

export const encodeReady = (m: Ready): ArrayBuffer => encode(READY, READY_LAYOUT, m);
export const decodeReady = (buffer: ArrayBuffer): Ready => decode<Ready>(READY_LAYOUT, buffer);

export const PARTFACES = 12;

/** The faces that a part's triangles belong to, and what each is there for at first; server to page. */
export interface PartFaces {
  /** index into PartFacts.faces for each triangle */
  faces: Float32Array;
  /** a Role for each triangle */
  roles: Float32Array;
}

const PARTFACES_LAYOUT: Layout = [
  ["faces", "floats"],
  ["roles", "floats"],
];

export const encodePartFaces = (m: PartFaces): ArrayBuffer => encode(PARTFACES, PARTFACES_LAYOUT, m);
export const decodePartFaces = (buffer: ArrayBuffer): PartFaces => decode<PartFaces>(PARTFACES_LAYOUT, buffer);

export const TRUSTMAP = 13;

/** The map of how well the force is known over the touched surface, server to page. */
export interface TrustMap {
  /** m, of the ball at each point */
  depth: number;
  /** upper end of the colour scale */
  high: number;
  /** values are deviations; otherwise only the trained region is known */
  known: boolean;
  /** deviation of the force over the force at each point; -1 not touched, -2 not trained */
  values: Float32Array;
}

const TRUSTMAP_LAYOUT: Layout = [
  ["depth", "f32"],
  ["high", "f32"],
  ["known", "flag"],
  ["values", "floats"],
];

export const encodeTrustMap = (m: TrustMap): ArrayBuffer => encode(TRUSTMAP, TRUSTMAP_LAYOUT, m);
export const decodeTrustMap = (buffer: ArrayBuffer): TrustMap => decode<TrustMap>(TRUSTMAP_LAYOUT, buffer);
