/** What goes between the page and its server. Made by scripts/page_types.py from page_messages.py,
 * robot_messages.py, settings_messages.py, requests.py and frames.py of src/tomoskin/server:
 * change those. */

/** A value as a skin file writes it. */
export type Value = string | number | readonly (string | number | readonly (string | number | readonly (string | number)[])[])[];

/** Everything about the skin that does not change from frame to frame. */
export interface Scene {
  readonly type: "scene";
  readonly skin: SkinName;
  readonly unit: string;
  readonly limit: number;
  readonly points: readonly number[];
  readonly solid: readonly number[] | null;
  readonly cells: readonly number[];
  readonly outline: readonly number[];
  readonly electrodes: readonly Electrode[];
  readonly pattern: PatternRows;
  readonly source: string;
  readonly pressable: boolean;
  readonly truth: boolean;
  readonly probe: ProbeSizes;
  readonly version: string;
  readonly same: SamePlaces | null;
}

/** The skin, by what its file says. */
export interface SkinName {
  readonly name: string;
  readonly description: string;
  readonly source: string;
}

/** An electrode: its centre, its name, and the mesh points along its arc. */
export interface Electrode {
  readonly x: number;
  readonly y: number;
  readonly label: string;
  readonly points: readonly number[];
}

/** Source, sink and plus, minus of each measurement, flat. */
export interface PatternRows {
  readonly name: string;
  readonly n_meas: number;
  readonly n_drive: number;
  readonly drive: readonly number[];
  readonly measure: readonly number[];
}

/** What a press from the page is at first, and at most. */
export interface ProbeSizes {
  readonly radius_m: number;
  readonly force_n: number;
  readonly max_force_n: number;
}

/** Places that the pattern cannot tell apart. */
export interface SamePlaces {
  readonly text: string;
  readonly maps: readonly (readonly number[])[];
  readonly least_m: number;
}

/** Another scale of the same scene. */
export interface Scale {
  readonly type: "scale";
  readonly limit: number;
  readonly unit: string;
}

/** One look at the runner. */
export interface RunState {
  readonly type: "state";
  readonly running: boolean;
  readonly paused: boolean;
  readonly fps: number;
  readonly frames: number;
  readonly dropped: number;
  readonly corrupt: number;
  readonly gaps: number;
  readonly late: number;
  readonly deaf: number;
  readonly p50_ms: number | null;
  readonly p99_ms: number | null;
  readonly stages: readonly StageNow[];
  readonly slowest: readonly SlowFrame[];
  readonly reference: ReferenceNow;
  readonly baseline: BaselineNow | null;
  readonly sick: readonly ElectrodeHealth[];
  readonly noise_v: number | null;
  readonly alpha: number;
  readonly rule: string;
  readonly left_out: number;
  readonly recording: string | null;
  readonly sinks: readonly SinkReport[];
  readonly replay: ReplayStatus | null;
  readonly calibration: CalibrationNow | null;
  readonly problem: string | null;
  readonly text: string;
}

/** How long one stage of the frame flow takes. */
export interface StageNow {
  readonly name: string;
  readonly p50_ms: number | null;
  readonly p99_ms: number | null;
}

/** A slow frame: what it took its time for, in words. */
export interface SlowFrame {
  readonly sequence: number;
  readonly host_time_s: number;
  readonly text: string;
}

/** How far the reference is, and how old it has become. */
export interface ReferenceNow {
  readonly frames: number;
  readonly needed: number;
  readonly age_s: number | null;
  readonly ready: boolean;
}

/** Drift since the reference as a part of it, how long it is held, and why it is stale. */
export interface BaselineNow {
  readonly drift: number | null;
  readonly held_s: number;
  readonly noise_v: number | null;
  readonly stale: string | null;
}

/** One electrode: ``electrode`` from 0, its ``state`` of :data:`STATES`, the ``reason`` in words and numbers, and ``since`` when in the frames' seconds (None while good). */
export interface ElectrodeHealth {
  readonly electrode: number;
  readonly state: string;
  readonly reason: string;
  readonly since: number | null;
}

/** How a sink is doing: ``well`` or not, in words, and what it sent and what was left out. */
export interface SinkReport {
  readonly name: string;
  readonly well: boolean;
  readonly text: string;
  readonly sent: number;
  readonly left_out: number;
}

/** Where a replay is: s from its first frame; ``speed`` None for as fast as it goes. */
export interface ReplayStatus {
  readonly now_s: number;
  readonly end_s: number;
  readonly speed: number | null;
  readonly loop: boolean;
  readonly ended: boolean;
}

/** How touches fit the calibration that locates them; ``broken``: someone must act. */
export interface CalibrationNow {
  readonly well: boolean;
  readonly broken: boolean;
  readonly findings: readonly string[];
}

/** Something that a person should know. */
export interface EventNote {
  readonly type: "event";
  readonly time_s: number;
  readonly kind: string;
  readonly text: string;
}

/** Answer to a request that was not understood, or cannot be done. */
export interface Refusal {
  readonly type: "error";
  readonly message: string;
}

/** Of each cell the part of a change that the data leave open, 0 to 1; or the problem. */
export interface UnresolvedMap {
  readonly type: "unresolved";
  readonly values: readonly number[] | null;
  readonly radius_m: number;
  readonly problem: string;
}

/** Why frames hold no dent of touches, in words; "" where they do. */
export interface DentNow {
  readonly type: "dent";
  readonly problem: string;
}

/** What happened in the recording that is played, at times from its first frame. */
export interface PlayedTimeline {
  readonly type: "timeline";
  readonly end_s: number;
  readonly notes: readonly EventNote[];
  readonly events: readonly EventNote[];
  readonly touches: readonly Span[];
}

/** A touch from its first frame to its last, s. */
export interface Span {
  readonly id: number;
  readonly kind: string;
  readonly begin: number;
  readonly end: number;
  readonly x: number;
  readonly y: number;
  readonly peak: number;
}

/** The session folder; ``others`` are not listed; ``share`` of the export is done, 0 to 1. */
export interface Files {
  readonly type: "files";
  readonly files: readonly FileEntry[];
  readonly others: number;
  readonly recording: string | null;
  readonly playing: string | null;
  readonly exporting: string | null;
  readonly share: number;
}

/** A file: size in bytes, when it was last written (s since 1970), notes on it. */
export interface FileEntry {
  readonly name: string;
  readonly kind: string;
  readonly size: number;
  readonly written: number;
  readonly notes: string;
}

/** An export has ended, and its file is there. */
export interface Exported {
  readonly type: "exported";
  readonly name: string;
}

/** What can be connected, and what is. */
export interface Sources {
  readonly type: "sources";
  readonly sources: readonly Offer[];
  readonly current: string;
  readonly host_protocol: string;
  readonly board: BoardNow | null;
  readonly problem: string | null;
}

/** A source that a page may choose: what opens it, and in words what it is. */
export interface Offer {
  readonly id: string;
  readonly text: string;
}

/** What the board says that it is; ``name`` is empty before protocol 1.2. */
export interface BoardNow {
  readonly name: string;
  readonly firmware: string;
  readonly protocol: string;
  readonly channels: number;
  readonly adc_bits: number;
  readonly current_ma: number;
  readonly unique_id: string;
}

/** Files of the calibrations in use; "" where the name is not known; null: none. */
export interface Calibrations {
  readonly type: "calibrations";
  readonly touch: string | null;
  readonly force: string | null;
  readonly depth: string | null;
  readonly most: Readonly<Record<string, number>>;
}

/** The guided flow; ``kind`` null: none goes on. ``offered``: those that may be begun. */
export interface FlowNow {
  readonly type: "flow";
  readonly offered: readonly string[];
  readonly kind: string | null;
  readonly paused: boolean;
  readonly phase: "hold" | "name" | "press" | "release" | "rest" | "rub" | "several";
  readonly dot: readonly [number, number] | null;
  readonly presses: readonly (readonly [number, number])[];
  readonly thinking: boolean;
  readonly text: string;
  readonly ready: boolean;
  readonly figures: Figures;
  readonly effort: "hard" | "softly" | null;
  readonly labels: readonly string[];
  readonly label: LabelNow | null;
  readonly asked: LabelNow | null;
  readonly meant: LabelNow | null;
  readonly rubbed: RubbedNow | null;
  readonly stage: string;
}

/** Numbers of an estimate, as far as its flow has them. */
export interface Figures {
  readonly errors_mm?: readonly number[];
  readonly median_mm?: number;
  readonly doubtful?: readonly number[];
  readonly probability?: number;
  readonly mapping?: string;
  readonly runner_up?: string;
  readonly errors?: readonly number[];
  readonly deviation_mm?: number;
  readonly remarks?: readonly string[];
}

/** A weight or depth, in the unit in which it was given, in SI, and in words. */
export interface LabelNow {
  readonly value: number;
  readonly unit: "N" | "g" | "kg" | "mm";
  readonly si: number;
  readonly text: string;
}

/** What was rubbed so far. */
export interface RubbedNow {
  readonly touches: number;
  readonly needed: number;
  readonly text: string;
  readonly enough: boolean;
  readonly places: readonly number[];
  readonly covered: readonly number[];
}

/** Every section and key of a skin file. */
export interface SchemaForm {
  readonly type: "schema";
  readonly sections: readonly SectionForm[];
}

/** The form of one section of a skin file. */
export interface SectionForm {
  readonly name: string;
  readonly meaning: string;
  readonly keys: readonly KeyForm[];
}

/** One key of a section. */
export interface KeyForm {
  readonly name: string;
  readonly kind: KindForm;
  readonly expected: string;
  readonly meaning: string;
  readonly required: boolean;
  readonly when: Condition | null;
  readonly effective: Condition | null;
  readonly unless: string | null;
  readonly locked: boolean;
}

/** What a value may be, for a form; ``names`` and ``inner`` are of the columns of rows. */
export interface KindForm {
  readonly form: "choice" | "number" | "quantity" | "rows" | "text";
  readonly words?: readonly string[];
  readonly low?: number;
  readonly high?: number;
  readonly unit?: string;
  readonly names?: readonly string[];
  readonly inner?: KindForm;
}

/** One of these ``words`` as the value of another key. */
export interface Condition {
  readonly key: string;
  readonly words: readonly string[];
}

/** The skin's settings by section; ``took_ms``: how long the last change took. */
export interface Settings {
  readonly type: "settings";
  readonly document: Readonly<Record<string, Readonly<Record<string, Value | null>>>>;
  readonly n_electrodes: number;
  readonly automatic_alpha: number | null;
  readonly alpha: number;
  readonly undo: number;
  readonly redo: number;
  readonly busy: boolean;
  readonly took_ms: number | null;
  readonly files: readonly string[];
  readonly builtin: readonly string[];
}

/** How far a change has come: ``done`` of ``stages``; ``stage`` null: before the first. */
export interface Progress {
  readonly type: "progress";
  readonly stage: "image" | "mesh" | "model" | "source" | "touches" | null;
  readonly done: number;
  readonly stages: number;
}

/** A setting was refused; section and key where the error names them. */
export interface SettingRefused {
  readonly type: "settings_error";
  readonly section: string | null;
  readonly key: string | null;
  readonly message: string;
}

/** The measurements of a named pattern, to be edited. */
export interface PatternTable {
  readonly type: "pattern";
  readonly name: string;
  readonly drive: readonly (readonly [number, number])[];
  readonly measure: readonly (readonly [number, number])[];
}

/** What is wrong with the twin, and how it is bent; ``noise`` LSB, null: its own. */
export interface TwinState {
  readonly type: "twin";
  readonly breakable: boolean;
  readonly cut: readonly number[];
  readonly noise: number | null;
  readonly bendable: boolean;
  readonly bends: "hinge" | "joint" | null;
  readonly bend: TwinBend | null;
  readonly stretch: TwinStretch | null;
  readonly size_m: number;
}

/** By ``angle`` rad, over a strip of ``length`` along ``axis``, rad from x, ``offset`` m off. */
export interface TwinBend {
  readonly angle: number;
  readonly axis: number;
  readonly length: number;
  readonly offset: number;
}

/** Relative elongations along ``axis``, rad from x, and across it. */
export interface TwinStretch {
  readonly along: number;
  readonly across: number;
  readonly axis: number;
}

/** The twin cannot be bent in this way. */
export interface TwinRefused {
  readonly type: "twin_refused";
  readonly message: string;
}

/** A robot's links and skins. */
export interface RobotScene {
  readonly type: "robot";
  readonly name: string;
  readonly bones: readonly number[];
  readonly links: readonly DrawnLink[];
  readonly undrawn: readonly string[];
  readonly skins: readonly PlacedShape[];
  readonly poses: readonly number[];
  readonly version: string;
}

/** What of a robot's link is drawn: the corners of its triangles, in its frame. */
export interface DrawnLink {
  readonly link: number;
  readonly corners: readonly number[];
}

/** A skin on a robot: the frame of its touches, and the corners of its triangles in it. */
export interface PlacedShape {
  readonly name: string;
  readonly frame: string;
  readonly source: string;
  readonly link: number | null;
  readonly corners: readonly number[];
}

/** How each skin of a robot is doing, and the name of the recording. */
export interface RobotState {
  readonly type: "robot-state";
  readonly skins: Readonly<Record<string, SkinState>>;
  readonly recording: string | null;
}

/** How one skin of a robot is doing. */
export interface SkinState {
  readonly running: boolean;
  readonly ready: boolean;
  readonly fps: number;
  readonly frames: number;
  readonly lost: number;
  readonly p99_ms: number | null;
  readonly problem: string | null;
  readonly text: string;
}

/** All presses that this page holds now. */
export interface SetPresses {
  readonly type: "presses";
  readonly presses: readonly PressRequest[];
}

/** One press: place m, force N, ``radius`` half of the face's size m, turned by ``angle`` rad. */
export interface PressRequest {
  readonly x: number;
  readonly y: number;
  readonly force: number;
  readonly radius: number;
  readonly shape?: "circle" | "finger" | "polygon" | "square";
  readonly angle?: number;
  readonly vertices?: readonly (readonly [number, number])[] | null;
}

/** All that is wrong with the twin from now on: electrodes cut, LSB of noise (null: its own). */
export interface SetTwin {
  readonly type: "twin";
  readonly cut: readonly number[];
  readonly noise: number | null;
}

/** How the twin's sheet is bent and stretched from now on; null: as at rest. */
export interface SetPose {
  readonly type: "pose";
  readonly bend?: BendRequest | null;
  readonly stretch?: StretchRequest | null;
}

/** By ``angle`` rad from rest, positive where the front becomes convex; for a sheet that lies flat, over a strip of ``length`` m along ``axis`` (rad from x), ``offset`` m off the middle. */
export interface BendRequest {
  readonly angle: number;
  readonly axis?: number;
  readonly length?: number;
  readonly offset?: number;
}

/** Relative elongations along ``axis`` (rad from x) and across it. */
export interface StretchRequest {
  readonly along: number;
  readonly across?: number;
  readonly axis?: number;
}

/** The next frames become the reference. */
export interface TakeReference {
  readonly type: "reference";
}

/** Hold the picture, or let it go on; frames are read and left out meanwhile. */
export interface SetPause {
  readonly type: "pause";
  readonly on: boolean;
}

/** A remark on the picture of this moment; goes into the recording as well. */
export interface Note {
  readonly type: "note";
  readonly text: string;
}

/** Play the recording from so many seconds after its first frame on. */
export interface Seek {
  readonly type: "seek";
  readonly at_s: number;
}

/** Play one read of the recording and stand still. */
export interface StepReplay {
  readonly type: "step";
}

/** Recorded seconds per second; null for as fast as the pictures are made. */
export interface SetSpeed {
  readonly type: "speed";
  readonly speed: number | null;
}

/** Begin the recording again at its end, or not. */
export interface SetLoop {
  readonly type: "loop";
  readonly on: boolean;
}

/** Record to a new file in the server's folder, or end the recording. */
export interface SetRecording {
  readonly type: "record";
  readonly on: boolean;
}

/** The map of what the data cannot tell, with the electrodes and the alpha of the moment. */
export interface AskUnresolved {
  readonly type: "unresolved";
}

/** This page shows the dent of touches, or does not any more; it is answered what there is. */
export interface ShowDent {
  readonly type: "dent";
  readonly on: boolean;
}

/** How long the page took of late from a frame's arrival to the end of drawing it, s. */
export interface Painted {
  readonly type: "painted";
  readonly p50_s: number;
  readonly p99_s: number;
}

/** Other values of the skin's keys, by section; the skin's schema says what each may be. */
export interface SetSettings {
  readonly type: "settings";
  readonly changes: Readonly<Record<string, Readonly<Record<string, Value | null>>>>;
}

/** Take the last change of settings back. */
export interface UndoSettings {
  readonly type: "undo";
}

/** Repeat the change that was undone. */
export interface RedoSettings {
  readonly type: "redo";
}

/** Write the settings to a skin file of the server's folder. */
export interface SaveSkin {
  readonly type: "save_skin";
  readonly name: string;
  readonly replace?: boolean;
}

/** Take the settings of a skin file of the server's folder, or of a built-in skin. */
export interface LoadSkin {
  readonly type: "load_skin";
  readonly name: string;
}

/** The rows of a named pattern on the skin's electrodes, to be edited. */
export interface AskPattern {
  readonly type: "pattern";
  readonly name: string;
}

/** What is in the session folder. */
export interface ListFiles {
  readonly type: "files";
}

/** Play a session of the folder. */
export interface OpenSession {
  readonly type: "open";
  readonly name: string;
}

/** Back from a replay to the source before it. */
export interface GoLive {
  readonly type: "live";
}

/** Convert a session of the folder to another format, into the folder. */
export interface ExportSession {
  readonly type: "export";
  readonly name: string;
  readonly format: "csv" | "gif" | "h5" | "mat" | "npz" | "parquet" | "png" | "touches";
}

/** Give a session of the folder another name. */
export interface RenameSession {
  readonly type: "rename";
  readonly name: string;
  readonly to: string;
}

/** Delete a session of the folder. */
export interface DeleteSession {
  readonly type: "delete";
  readonly name: string;
}

/** Write notes on a session of the folder, in place of older ones. */
export interface Annotate {
  readonly type: "annotate";
  readonly name: string;
  readonly text: string;
}

/** The page asks what can be connected. */
export interface ListSources {
  readonly type: "sources";
}

/** Connect one of the sources that were listed. */
export interface Connect {
  readonly type: "connect";
  readonly source: string;
}

/** Ask for presses: where the dot is, to learn touch or to find the channel mapping; with known weights or to known depths, to learn these; or as another flow of those that are offered. */
export interface BeginFlow {
  readonly type: "flow_begin";
  readonly kind: string;
}

/** This page shows the flow, or hides it: while no page shows it, it is paused. */
export interface ShowFlow {
  readonly type: "flow_show";
  readonly on: boolean;
}

/** Take one press back, by its number from 0 on; null: the last one. */
export interface DeletePress {
  readonly type: "flow_delete";
  readonly number?: number | null;
}

/** The weight or depth of a press, or the next; ``sure``: an unusual one is meant as it is said. */
export interface SetLabel {
  readonly type: "flow_label";
  readonly value: number;
  readonly unit: "N" | "g" | "kg" | "mm";
  readonly sure?: boolean;
}

/** Ask for a press at a known position beside the rubbing, or go on without. */
export interface AskPoint {
  readonly type: "flow_point";
  readonly on: boolean;
}

/** Learn from what was rubbed so far. */
export interface LearnFlow {
  readonly type: "flow_learn";
}

/** The page ends what is being learnt. */
export interface StopLearning {
  readonly type: "flow_stop";
}

/** Leave the flow; what was pressed is forgotten. */
export interface EndFlow {
  readonly type: "flow_end";
}

/** Write what the presses tell to a file of the folder, and use it from now on. */
export interface KeepFlow {
  readonly type: "flow_keep";
  readonly name: string;
}

/** Use a calibration of the folder; null: none of those ``of`` touch, force or depth. */
export interface UseCalibration {
  readonly type: "calibration";
  readonly name: string | null;
  readonly of?: "depth" | "force" | "touch";
}

/** The newest touches on each skin of a robot; sent as JSON in bytes, the newest only. */
export interface RobotTouches {
  readonly skins: Readonly<Record<string, TouchesOfSkin>>;
  readonly poses: readonly number[];
}

/** The touches on one skin, and whether its data can be relied on. */
export interface TouchesOfSkin {
  readonly valid: boolean;
  readonly touches: readonly SpaceTouch[];
  readonly pose_problem: string | null;
}

/** A touch where the robot is drawn, in the frame of its root. */
export interface SpaceTouch {
  readonly id: number;
  readonly position: readonly [number, number, number];
  readonly normal: readonly [number, number, number];
  readonly peak: number;
  readonly force: number | null;
  readonly more_than: number | null;
  readonly is_self: boolean | null;
}

/** What the page shows of a reading. */
export interface ShownReading {
  readonly words: string;
  readonly sentence: string;
  readonly place: "sheet" | "touches";
  readonly wrong: boolean;
  readonly unit: string;
  readonly value: string;
  readonly deviation: string;
  readonly drawn: readonly [number, number] | null;
  readonly notes: readonly string[];
}

/** How the sheet is deformed as a whole in a frame, as every message says it (docs/sinks.md). */
export interface DeformationNow {
  readonly kind: "common" | "fold" | "stretch" | "unknown";
  readonly unit: "rad" | "relative" | "strain";
  readonly axis: EstimatedNow | null;
  readonly offset: EstimatedNow | null;
  readonly width: EstimatedNow | null;
  readonly amount: EstimatedNow | null;
  readonly across: EstimatedNow | null;
  readonly confused: string | null;
  readonly text: string;
}

/** A number, and the interval that nine in ten lie in. */
export interface EstimatedNow {
  readonly value: number | null;
  readonly low: number | null;
  readonly high: number | null;
}

export type ServerMessage =
  | Scene
  | Scale
  | RunState
  | EventNote
  | Refusal
  | UnresolvedMap
  | DentNow
  | PlayedTimeline
  | Files
  | Exported
  | Sources
  | Calibrations
  | FlowNow
  | SchemaForm
  | Settings
  | Progress
  | SettingRefused
  | PatternTable
  | TwinState
  | TwinRefused;

export type RobotMessage =
  | RobotScene
  | RobotState
  | Refusal;

export type PageRequest =
  | SetPresses
  | SetTwin
  | SetPose
  | TakeReference
  | SetPause
  | Note
  | Seek
  | StepReplay
  | SetSpeed
  | SetLoop
  | SetRecording
  | AskUnresolved
  | ShowDent
  | Painted
  | SetSettings
  | UndoSettings
  | RedoSettings
  | SaveSkin
  | LoadSkin
  | AskPattern
  | ListFiles
  | OpenSession
  | GoLive
  | ExportSession
  | RenameSession
  | DeleteSession
  | Annotate
  | ListSources
  | Connect
  | BeginFlow
  | ShowFlow
  | DeletePress
  | SetLabel
  | AskPoint
  | LearnFlow
  | StopLearning
  | EndFlow
  | KeepFlow
  | UseCalibration;

export const HEADER_BYTES = 40;

export const readHeader = (data: DataView, at: number) => ({
  sequence: data.getUint32(at + 4, true),
  hostTime: data.getFloat64(at + 8, true),
  nCells: data.getUint32(at + 16, true),
  nMeas: data.getUint32(at + 20, true),
  nTouches: data.getUint16(at + 24, true),
  nTruth: data.getUint16(at + 26, true),
  flags: data.getUint32(at + 28, true),
  latencyUs: data.getUint32(at + 32, true),
  nDent: data.getUint32(at + 36, true),
});

export const TOUCH_BYTES = 64;

export const readTouch = (data: DataView, at: number) => ({
  id: data.getUint32(at, true),
  kind: data.getUint8(at + 4),
  several: data.getUint8(at + 5),
  own: data.getUint8(at + 6),
  provisional: data.getUint8(at + 7),
  x: data.getFloat32(at + 8, true),
  y: data.getFloat32(at + 12, true),
  sdX: data.getFloat32(at + 16, true),
  sdY: data.getFloat32(at + 20, true),
  area: data.getFloat32(at + 24, true),
  peak: data.getFloat32(at + 28, true),
  since: data.getFloat32(at + 32, true),
  covXy: data.getFloat32(at + 36, true),
  force: data.getFloat32(at + 40, true),
  forceLow: data.getFloat32(at + 44, true),
  forceHigh: data.getFloat32(at + 48, true),
  depth: data.getFloat32(at + 52, true),
  depthLow: data.getFloat32(at + 56, true),
  depthHigh: data.getFloat32(at + 60, true),
});

export const TRUTH_BYTES = 16;

export const readTruth = (data: DataView, at: number) => ({
  x: data.getFloat32(at, true),
  y: data.getFloat32(at + 4, true),
  force: data.getFloat32(at + 8, true),
  radius: data.getFloat32(at + 12, true),
});

export const FLAGS = { ready: 1, noImage: 2, rowsLeftOut: 4 } as const;

export const MAGIC = 0x314b5354;

export const DENT_STEP = 2e-06;
