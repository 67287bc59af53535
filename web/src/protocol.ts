/** The messages between server and page, as JSON. Lengths in metres, times in seconds. */

export interface Electrode {
  readonly x: number;
  readonly y: number;
  readonly label: string;
  /** Mesh points along the electrode's arc. */
  readonly points: readonly number[];
}

export interface PatternTable {
  readonly name: string;
  readonly n_meas: number;
  readonly n_drive: number;
  /** Source, sink of each row, flat. */
  readonly drive: readonly number[];
  /** Plus, minus of each row, flat. */
  readonly measure: readonly number[];
}

export interface Scene {
  readonly type: "scene";
  readonly skin: { readonly name: string; readonly description: string; readonly source: string };
  readonly unit: "S" | "relative";
  /** The fixed symmetric colour limit, in `unit`. */
  readonly limit: number;
  /** x, y of each mesh point, flat. */
  readonly points: readonly number[];
  /** x, y, z of each mesh point, flat; null: the sheet lies flat. */
  readonly solid: readonly number[] | null;
  /** Three mesh points of each cell, flat. */
  readonly cells: readonly number[];
  /** x, y along the closed outline, flat. */
  readonly outline: readonly number[];
  readonly electrodes: readonly Electrode[];
  readonly pattern: PatternTable;
  readonly source: string;
  readonly pressable: boolean;
  readonly probe: {
    readonly radius_m: number;
    readonly force_n: number;
    readonly max_force_n: number;
  };
  readonly version: string;
}

/** Another scale of the same scene. */
export interface Scale {
  readonly type: "scale";
  readonly limit: number;
  readonly unit: Scene["unit"];
}

export interface Sick {
  readonly electrode: number;
  readonly state: string;
  /** In words, for people. */
  readonly reason: string;
  readonly since_s: number;
}

/** Where a replay is, s from its first frame. */
export interface Replay {
  readonly now_s: number;
  readonly end_s: number;
  /** Null: as fast as it goes. */
  readonly speed: number | null;
  readonly loop: boolean;
  readonly ended: boolean;
}

export interface Stage {
  readonly name: string;
  readonly p50_ms: number | null;
  readonly p99_ms: number | null;
}

export interface ClassReading {
  readonly name: string;
  readonly probability: number;
  /** It looks like none that was learnt; `name` is the nearest. */
  readonly unknown: boolean;
}

/** How far today's frames are from what the calibration of touch was learnt on, in words. */
export interface CalibrationHealth {
  readonly well: boolean;
  /** Whether someone must act. */
  readonly broken: boolean;
  readonly findings: readonly string[];
}

export interface SlowFrame {
  readonly sequence: number;
  readonly host_time_s: number;
  /** How long it took, and for what, in words. */
  readonly text: string;
}

export interface Status {
  readonly type: "state";
  readonly running: boolean;
  readonly paused: boolean;
  readonly fps: number;
  readonly dropped: number;
  readonly corrupt: number;
  readonly gaps: number;
  readonly p50_ms: number | null;
  readonly p99_ms: number | null;
  /** How long each stage takes, from the sample to the page. */
  readonly stages: readonly Stage[];
  /** What the slowest frames took their time for, the slowest first. */
  readonly slowest: readonly SlowFrame[];
  readonly reference: {
    readonly frames: number;
    readonly needed: number;
    readonly age_s: number | null;
    readonly ready: boolean;
  };
  /** What has become of the reference since it stands; null before. */
  readonly baseline: {
    readonly drift: number | null;
    readonly held_s: number;
    readonly noise_v: number | null;
    readonly stale: string | null;
  } | null;
  /** Electrodes that are not good, counted from 0. */
  readonly sick: readonly Sick[];
  readonly replay: Replay | null;
  /** Which of the learnt classes the newest frame shows; null where none was learnt. */
  readonly class: ClassReading | null;
  /** Null where no calibration of touch is in use, or nothing has touched the skin yet. */
  readonly calibration: CalibrationHealth | null;
  readonly noise_v: number | null;
  /** Weight of the prior in the pictures, and the rule that chose it ("hand": the skin file). */
  readonly alpha: number;
  readonly rule: string;
  /** Rows that the newest picture does without. */
  readonly left_out: number;
  /** The file that is being recorded to. */
  readonly recording: string | null;
  /** What someone must act on, in words. */
  readonly problem: string | null;
  readonly text: string;
}

export interface EventNote {
  readonly type: "event";
  readonly time_s: number;
  readonly kind: string;
  readonly text: string;
}

export interface Refusal {
  readonly type: "error";
  readonly message: string;
}

/** Any message of the server; `state.ts` calls who has asked for those of its type. */
export interface ServerMessage {
  readonly type: string;
}

export interface Press {
  readonly x: number;
  readonly y: number;
  /** Newtons. */
  readonly force: number;
  readonly radius: number;
}

/** Any message to the server, which checks it strictly (server/requests.py). */
export interface PageMessage {
  readonly type: string;
}
