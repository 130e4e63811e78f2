// The websocket, in a worker of its own: the page's heartbeat doesn't wait for drawing. The page posts the hand; where the page
// is busy the worker repeats the hand's last message, so that a slow picture is no stall. A page that hangs for seconds is one.

const BEAT = 50; // ms between heartbeats
const HANGS = 2000; // ms without a word from the page until its hand is believed no more
const FIRST_DELAY = 300; // ms until the first new attempt
const LONGEST_DELAY = 3000; // ms

/** From the page: where to connect, a hand, or another message. */
export interface Order {
  address?: string;
  hand?: ArrayBuffer;
  message?: ArrayBuffer;
}

/** To the page: a message, or that the connection stands or is lost. */
export type Report = { data: string | ArrayBuffer } | { open: boolean };

let address = "";
let socket: WebSocket | null = null;
let delay = FIRST_DELAY;
let hand: ArrayBuffer | null = null;
let sent = 0; // ms
let heard = 0; // ms, of the page

function open(): void {
  const made = new WebSocket(address);
  made.binaryType = "arraybuffer";
  made.onopen = () => report({ open: true });
  made.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
    delay = FIRST_DELAY;
    report({ data: event.data });
  };
  made.onclose = () => {
    hand = null; // another connection begins without a hand
    report({ open: false });
    setTimeout(open, delay);
    delay = Math.min(delay * 1.6, LONGEST_DELAY);
  };
  socket = made;
}

function report(news: Report): void {
  const transfer = "data" in news && news.data instanceof ArrayBuffer ? [news.data] : [];
  postMessage(news, { transfer });
}

function send(bytes: ArrayBuffer): void {
  if (socket?.readyState === WebSocket.OPEN) socket.send(bytes);
}

function beat(): void {
  const now = performance.now();
  if (!hand || now - sent < 0.9 * BEAT || now - heard > HANGS) return;
  sent = now;
  send(hand);
}

onmessage = ({ data }: MessageEvent<Order>) => {
  heard = performance.now();
  if (data.message) send(data.message);
  if (data.hand) {
    [hand, sent] = [data.hand, heard];
    send(data.hand);
  }
  if (data.address) {
    address = data.address;
    open();
    setInterval(beat, BEAT / 2);
  }
};
