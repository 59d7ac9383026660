// Which moment is shown: of a running episode the newest, a little late so that motion is smooth; of a finished one what its reader wants.

/** Steps of a running episode come in bursts, as fast as they are simulated. They are shown within about so long. */
const BEHIND_S = 0.5;

/** Shows the steps of a running episode one after the other. */
export class LiveTime {
  constructor(first) {
    this.frames = [first];
    this.time = first.time;
  }

  add(frame) {
    if (frame.time > this.frames.at(-1).time) this.frames.push(frame);
  }

  /** The two steps and the share between them that are shown after `seconds` more. */
  pass(seconds) {
    const end = this.frames.at(-1).time;
    // The more there is to show, the faster it is shown, and never slower than it was.
    const speed = Math.max(1, (end - this.time) / BEHIND_S);
    const before = this.time;
    this.time = Math.min(end, this.time + seconds * speed);
    while (this.frames.length > 2 && this.frames[1].time <= this.time) this.frames.shift();
    return { ...between(this.frames, this.time), moved: this.time !== before };
  }
}

/** Goes to and fro in a finished episode. */
export class RecordedTime {
  constructor(frames, at) {
    this.frames = frames;
    this.begin = frames[0].time;
    this.end = frames.at(-1).time;
    this.playing = false;
    this.speed = 1;
    this.seek(at || this.begin);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, this.begin), this.end);
    this.moved = true;
  }

  play(playing) {
    if (playing && this.time >= this.end) this.seek(this.begin);
    this.playing = playing;
  }

  pass(seconds) {
    if (this.playing) {
      this.seek(this.time + seconds * this.speed);
      if (this.time >= this.end) this.playing = false;
    }
    const { moved } = this;
    this.moved = false;
    return { ...between(this.frames, this.time), moved };
  }
}

/** The two frames around a time, and how far it is from the one to the other. */
function between(frames, time) {
  let low = 0;
  let high = frames.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (frames[middle].time < time) low = middle + 1;
    else high = middle;
  }
  const to = frames[low];
  const from = frames[Math.max(0, low - 1)];
  const span = to.time - from.time;
  return { from, to, share: span > 0 ? (time - from.time) / span : 1 };
}
