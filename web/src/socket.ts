/** The connection to the server: opens, says what happens to it, and comes back with back-off. */

import type { PageRequest } from "./wire";

const FIRST_WAIT = 500;
const LONGEST_WAIT = 8000;
/** Milliseconds in which a connection opens, or is tried again: a server that ends may leave one
 * half open, and a browser waits for minutes. */
const OPENS_WITHIN = 10_000;

/** `refused`: the server answers but does not know this page any more (it was started again). */
export type LinkState =
  | { readonly phase: "connecting" }
  | { readonly phase: "open" }
  | { readonly phase: "lost"; readonly since: number; readonly retryAt: number; readonly refused: boolean };

export interface Listener<M> {
  message(message: M): void;
  frame(bytes: ArrayBuffer): void;
  link(state: LinkState): void;
}

/** Milliseconds before the n-th try after a loss, n from 0. */
export function backOff(tries: number): number {
  return Math.min(LONGEST_WAIT, FIRST_WAIT * 2 ** tries);
}

/** Where the page's own server listens. */
export function socketAddress(location: Pick<Location, "href">): string {
  const url = new URL("./ws", location.href);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  url.search = "";
  return url.href;
}

async function isRefused(): Promise<boolean> {
  try {
    return (await fetch("./", { method: "GET", cache: "no-store" })).status === 403;
  } catch {
    return false;
  }
}

/** `M`: what the server sends as text. */
export class Connection<M> {
  private socket: WebSocket | null = null;
  private tries = 0;
  private timer = 0;
  private lostSince = 0;

  constructor(
    private readonly address: string,
    private readonly listener: Listener<M>,
  ) {}

  open(): void {
    window.clearTimeout(this.timer);
    if (this.socket) return;
    const socket = new WebSocket(this.address);
    socket.binaryType = "arraybuffer";
    const limit = window.setTimeout(() => socket.close(), OPENS_WITHIN);
    socket.onopen = () => {
      window.clearTimeout(limit);
      this.tries = 0;
      this.lostSince = 0;
      this.listener.link({ phase: "open" });
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.receive(event.data);
    socket.onclose = () => {
      window.clearTimeout(limit);
      void this.lost();
    };
    this.socket = socket;
  }

  /** Send if connected; what is lost with the connection is not sent later. */
  send(message: PageRequest): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private receive(data: string | ArrayBuffer): void {
    if (typeof data !== "string") return this.listener.frame(data);
    const message: unknown = JSON.parse(data);
    if (message !== null && typeof message === "object" && "type" in message) {
      this.listener.message(message as M);
    }
  }

  private async lost(): Promise<void> {
    this.socket = null;
    this.lostSince ||= performance.now();
    const wait = backOff(this.tries++);
    const retryAt = performance.now() + wait;
    this.timer = window.setTimeout(() => this.open(), wait);
    const state = { phase: "lost", since: this.lostSince, retryAt, refused: false } as const;
    this.listener.link(state);
    if ((await isRefused()) && !this.socket) this.listener.link({ ...state, refused: true });
  }
}
