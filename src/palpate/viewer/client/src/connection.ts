// The websocket: reconnects by itself, grants credits, keeps only the newest frame.

import { decodeFrame, encodeCredit, encodeHand, encodeRecordWish, isHello, isNotice, isRecording, PROTOCOL } from "./messages";
import type { Frame, Hand, Hello, Notice, Recording } from "./messages";

const CREDITS_AT_START = 2; // one frame on its way while one is drawn
const FIRST_DELAY = 300; // ms until the first new attempt
const LONGEST_DELAY = 3000; // ms

export interface Listener {
  hello(hello: Hello): void;
  notice(notice: Notice): void;
  recording(recording: Recording): void;
  lost(): void;
}

export class Connection {
  private socket: WebSocket | null = null;
  private delay = FIRST_DELAY;
  private newest: Frame | null = null;
  private owed = 0;

  constructor(private readonly listener: Listener) {
    this.open();
  }

  get connected(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  send(hand: Hand): void {
    if (this.connected) this.socket?.send(encodeHand(hand));
  }

  record(wanted: boolean): void {
    if (this.connected) this.socket?.send(encodeRecordWish({ wanted }));
  }

  /** The newest frame not drawn yet; taking it grants the server as many more as have come. */
  take(): Frame | null {
    const frame = this.newest;
    if (frame && this.connected) {
      this.socket?.send(encodeCredit({ frames: this.owed }));
      this.owed = 0;
    }
    this.newest = null;
    return frame;
  }

  private open(): void {
    const socket = new WebSocket(`ws://${location.host}/touch`);
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => this.receive(socket, event.data);
    socket.onclose = () => this.closed();
    this.socket = socket;
  }

  private receive(socket: WebSocket, data: string | ArrayBuffer): void {
    if (typeof data !== "string") {
      this.newest = decodeFrame(data);
      this.owed += 1;
      return;
    }
    const message = JSON.parse(data) as { kind: string };
    if (isNotice(message)) this.listener.notice(message);
    if (isRecording(message)) this.listener.recording(message);
    if (!isHello(message)) return;
    if (message.protocol !== PROTOCOL) {
      location.reload(); // the server is of another version than this page
      return;
    }
    this.delay = FIRST_DELAY;
    this.owed = 0;
    this.listener.hello(message);
    socket.send(encodeCredit({ frames: CREDITS_AT_START }));
  }

  private closed(): void {
    this.newest = null;
    this.listener.lost();
    setTimeout(() => this.open(), this.delay);
    this.delay = Math.min(this.delay * 1.6, LONGEST_DELAY);
  }
}
