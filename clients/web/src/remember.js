// Choices of the viewer that a browser keeps for the next visit. Without storage they last as long as the page.

/// Makes an object whose properties are read from localStorage and written to it; `defaults` are their values until then.
export function makeRemembered(name, defaults) {
  const key = `sonard.${name}`;
  let values = { ...defaults };
  try {
    values = { ...defaults, ...JSON.parse(localStorage.getItem(key) ?? '{}') };
  } catch {
    // it cannot be read: use the defaults
  }
  return new Proxy(values, {
    set(target, property, value) {
      target[property] = value;
      try {
        localStorage.setItem(key, JSON.stringify(target));
      } catch {
        // storage is full or forbidden
      }
      return true;
    },
  });
}
