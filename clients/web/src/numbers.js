// Formats numbers. Unknown values are shown as a dash.

const thin = '\u202f';  // a space at which lines do not break
const known = (value) => typeof value === 'number' && Number.isFinite(value);

export const dash = '–';
/// 12909 -> "12 909", with thin spaces.
export const whole = (value) => (known(value) ? String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, thin) : dash);
export const fixed = (value, digits) => (known(value) ? value.toFixed(digits).replace(/^-(0\.?0*)$/, '$1') : dash);
/// Formats a number in the shortest form: 10, 7.5
export const short = (value, digits = 2) => (known(value) ? String(Number(value.toFixed(digits))) : dash);
export const clockTime = (ns) => new Date(ns / 1e6).toTimeString().slice(0, 8);
/// Formats seconds as 0:09 or 1:30.
export const countdown = (seconds) => {
  const left = Math.max(0, Math.ceil(seconds));
  return `${Math.floor(left / 60)}:${String(left % 60).padStart(2, '0')}`;
};
export const frequency = (hz) => (!known(hz) || hz <= 0 ? dash : hz >= 1e6 ? `${short(hz / 1e6, 1)} MHz` : `${short(hz / 1e3, 0)} kHz`);
/// Formats bits per second as Mbit/s; values below one have one more digit.
export const megabits = (bits) => (known(bits) ? fixed(bits / 1e6, bits < 1e6 ? 2 : 1) : dash);
