// Rates of counters that are read from time to time.

const window_s = 4;  // counts are integers: with a shorter window 7.0 would be shown as 6.5
const slow_window_s = 5;  // the window for rates below slow_hz
const slow_hz = 2;

/// The readings of one counter. Its rate is over window_s, or slow_window_s if it is below slow_hz.
export class Counter {
  readings = [];

  add(time_s, count) {
    const last = this.readings.at(-1);
    if (last && (time_s < last.time_s || count < last.count)) this.readings = [];  // the counter started again
    this.readings.push({ time_s, count });
    while (this.readings.length > 2 && this.readings[1].time_s <= time_s - slow_window_s) this.readings.shift();
  }

  /// The rate per second, or undefined with fewer than two readings.
  get rate() {
    const quick = this.over(window_s);
    return quick !== undefined && quick < slow_hz ? this.over(slow_window_s) : quick;
  }

  over(seconds) {
    const last = this.readings.at(-1);
    if (this.readings.length < 2) return undefined;
    const first = this.readings.findLast((reading) => reading.time_s <= last.time_s - seconds + 0.05) ?? this.readings[0];
    return last.time_s > first.time_s ? (last.count - first.count) / (last.time_s - first.time_s) : undefined;
  }
}

/// One counter per name; names that are no longer read are removed.
export class Counters {
  counters = new Map();
  update(time_s, counts) {
    for (const name of this.counters.keys()) if (!counts.has(name)) this.counters.delete(name);
    for (const [name, count] of counts) {
      if (!this.counters.has(name)) this.counters.set(name, new Counter());
      this.counters.get(name).add(time_s, count);
    }
  }
  rate(name) {
    return this.counters.get(name)?.rate;
  }
}
