// The shown moment: of a running episode the newest, with a short delay so that motion is smooth; of a finished one the reader's choice.

/** @typedef {import("./message.js").Frame} Frame */

/**
 * Steps of a running episode come in bursts, as fast as they are simulated. They are shown within about this
 * time.
 */
const BEHIND_S = 0.5;

/** Shows the steps of a running episode one after the other. */
export class LiveTime {
  /** @param {Frame} first */
  constructor(first) {
    /** @type {Frame[]} */
    this.frames = [first];
    this.time = first.time;
  }

  /** Receives a step. @param {Frame} frame */
  add(frame) {
    if (frame.time > last(this.frames).time) this.frames.push(frame);
  }

  /**
   * Returns the two steps and the share between them that are shown after `seconds` more.
   * @param {number} seconds
   */
  pass(seconds) {
    const end = last(this.frames).time;
    // A longer backlog is shown faster, and never below the original speed.
    const speed = Math.max(1, (end - this.time) / BEHIND_S);
    const before = this.time;
    this.time = Math.min(end, this.time + seconds * speed);
    while (this.frames.length > 2 && this.frames[1].time <= this.time) this.frames.shift();
    return { ...between(this.frames, this.time), moved: this.time !== before };
  }
}

/** Moves forward and backward in a finished episode. */
export class RecordedTime {
  /** @param {Frame[]} frames @param {number} [at] the moment at which it begins */
  constructor(frames, at) {
    this.frames = frames;
    this.begin = frames[0].time;
    this.end = last(frames).time;
    this.time = this.begin;
    this.moved = true;
    this.playing = false;
    this.speed = 1;
    this.seek(at || this.begin);
  }

  /** Moves to a moment, or to the nearest one in the episode. @param {number} time */
  seek(time) {
    this.time = Math.min(Math.max(time, this.begin), this.end);
    this.moved = true;
  }

  /** @param {boolean} playing */
  play(playing) {
    if (playing && this.time >= this.end) this.seek(this.begin);
    this.playing = playing;
  }

  /**
   * Returns the two steps and the share between them that are shown after `seconds` more.
   * @param {number} seconds
   */
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

/**
 * Returns the two frames around a time, and its relative place between the two.
 * @param {Frame[]} frames
 * @param {number} time
 */
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

/** Returns the last of at least one frame. @param {Frame[]} frames */
const last = (frames) => frames[frames.length - 1];
