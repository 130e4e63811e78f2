// The page's end of the connection, whose websocket lives in a worker: grants credits, keeps only the newest frame.

import {
  decodeFrame,
  encodeCredit,
  encodeHand,
  encodeReady,
  encodeRecordWish,
  encodeStopWish,
  isFeel,
  isHello,
  isNotice,
  isReason,
  isRecording,
  PROTOCOL,
} from "./messages";
import type { Feel, Frame, Hand, Hello, Notice, Reason, Recording } from "./messages";
import type { Order, Report } from "./socket_worker";

const CREDITS_AT_START = 2; // one frame on its way while one is drawn

export interface Listener {
  hello(hello: Hello): void;
  notice(notice: Notice): void;
  recording(recording: Recording): void;
  reason(reason: Reason): void;
  feel(feel: Feel): void;
  lost(): void;
}

/** What a page of a touched body needs of whoever answers it. */
export type Link = Pick<Connection, "connected" | "send" | "record" | "stop" | "ready" | "take">;

/** Join the server. */
export function joinServer(listener: Listener): Link {
  return new Connection(listener);
}

class Connection {
  connected = false;

  private readonly worker = new Worker(new URL("./socket_worker.ts", import.meta.url), { type: "module" });
  private newest: Frame | null = null;
  private owed = 0;
  private greeted = false; // since the connection stands

  constructor(private readonly listener: Listener) {
    this.worker.onmessage = ({ data }: MessageEvent<Report>) => {
      if ("data" in data) this.receive(data.data);
      else this.connected = data.open;
      if ("open" in data && !data.open) this.closed();
    };
    this.order({ address: `ws://${location.host}/touch` });
  }

  /** Send the hand; the worker repeats it as a heartbeat. */
  send(hand: Hand): void {
    if (this.connected) this.order({ hand: encodeHand(hand) });
  }

  record(wanted: boolean): void {
    if (this.connected) this.order({ message: encodeRecordWish({ wanted }) });
  }

  /** End all force, or the stop. */
  stop(stop: boolean): void {
    if (this.connected) this.order({ message: encodeStopWish({ stop }) });
  }

  /** Say that this version of the body can be drawn. */
  ready(version: number): void {
    if (this.connected) this.order({ message: encodeReady({ version }) });
  }

  /** The newest frame not drawn yet; taking it grants the server as many more as have come. */
  take(): Frame | null {
    const frame = this.newest;
    if (frame && this.connected) {
      this.order({ message: encodeCredit({ frames: this.owed }) });
      this.owed = 0;
    }
    this.newest = null;
    return frame;
  }

  private order(order: Order): void {
    this.worker.postMessage(order);
  }

  private receive(data: string | ArrayBuffer): void {
    if (typeof data !== "string") {
      this.newest = decodeFrame(data);
      this.owed += 1;
      return;
    }
    const message = JSON.parse(data) as { kind: string };
    if (isNotice(message)) this.listener.notice(message);
    if (isRecording(message)) this.listener.recording(message);
    if (isReason(message)) this.listener.reason(message);
    if (isFeel(message)) this.listener.feel(message);
    if (!isHello(message)) return;
    if (message.protocol !== PROTOCOL) {
      location.reload(); // the server is of another version than this page
      return;
    }
    this.listener.hello(message);
    if (this.greeted) return; // another version of the same body: the credits go on
    this.greeted = true;
    this.owed = 0;
    this.order({ message: encodeCredit({ frames: CREDITS_AT_START }) });
  }

  private closed(): void {
    this.newest = null;
    this.greeted = false;
    this.listener.lost();
  }
}
