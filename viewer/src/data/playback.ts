/** Position of the page in a recording; time is an argument. */
export class Playback {
  t = 0;
  duration = 0;
  speed = 1;
  playing = false;
  /** For a running robot: stays at the newest time. */
  following = false;

  seek(t: number): void {
    this.following = false;
    this.t = Math.min(this.duration, Math.max(0, t));
  }
  toggle(): void {
    if (this.following) { this.following = false; return; } // hold the current image
    if (!this.playing && this.t >= this.duration) this.t = 0;
    this.playing = !this.playing && this.duration > 0;
  }
  /** Returns whether the time changed. */
  advance(seconds: number): boolean {
    if (!this.playing || seconds <= 0) return false;
    this.seek(this.t + seconds * this.speed);
    if (this.t >= this.duration) this.playing = false;
    return true;
  }
  /** Moves to the next (or previous) of these times, or by a second if there is none; stops playing. */
  step(times: ArrayLike<number>, direction: 1 | -1): void {
    this.playing = false;
    const small = 1e-6;
    let target: number | undefined;
    for (let i = 0; i < times.length; ++i) {
      const time = times[i]!;
      if (direction > 0 && time > this.t + small) { target = time; break; }
      if (direction < 0 && time < this.t - small) target = time;
    }
    this.seek(target ?? this.t + direction);
  }
}

/** "1:05.3" */
export function clockText(seconds: number): string {
  const tenths = Math.round(Math.max(0, seconds) * 10);
  const minutes = Math.floor(tenths / 600);
  return `${minutes}:${String(Math.floor((tenths % 600) / 10)).padStart(2, "0")}.${tenths % 10}`;
}
