// The resolution of the picture: where drawing is slow, fewer pixels; once nothing moves, all of them again.

const SLOW = 36; // ms a picture, from which on there are too many pixels
const FAST = 18; // ms, below which there may be more
const LEAST = 0.35; // of the display's resolution
const STEP = 0.7;
const SAMPLES = 6; // pictures between two changes
const STILL = 500; // ms without a change until a picture at rest is drawn whole
const AGAIN = 20_000; // ms until more pixels are tried once more, after they were too many

export class Resolution {
  /** of the display's, of the next picture */
  share = 1;

  private moving = 1;
  private cost = 0; // ms of a picture, smoothed
  private samples = 0;
  private last = 0; // when it was asked last
  private drew = false;
  private changed = 0;
  private raised = -Infinity;
  private notBefore = 0;

  /** Hear, once per display frame, whether there is something to draw; true where a picture is due, of `share`. */
  due(now: number, dirty: boolean): boolean {
    if (this.drew) this.count(now, now - this.last);
    this.last = now;
    if (dirty) this.changed = now;
    const rest = now - this.changed > STILL;
    this.drew = dirty || (rest && this.share < 1);
    if (this.drew) this.share = rest ? 1 : this.moving;
    if (rest) this.samples = 0;
    return this.drew;
  }

  /** One picture's time, to the next display frame: what the browser and the graphics take is not told otherwise. */
  private count(now: number, took: number): void {
    if (this.share !== this.moving) return; // the one at rest
    this.cost = this.samples === 0 ? took : this.cost + 0.25 * (Math.min(took, 250) - this.cost);
    this.samples += 1;
    if (this.samples < SAMPLES) return;
    if (this.cost > SLOW && this.moving > LEAST) {
      if (now - this.raised < AGAIN) this.notBefore = now + AGAIN;
      this.change(Math.max(LEAST, this.moving * STEP));
    } else if (this.cost < FAST && this.moving < 1 && this.samples > 5 * SAMPLES && now > this.notBefore) {
      this.raised = now;
      this.change(Math.min(1, this.moving / STEP));
    }
  }

  private change(share: number): void {
    [this.moving, this.samples] = [share, 0];
  }
}
