// Colours pictures that sonard has drawn (/SONAR/fan, mono8; 0 = outside): those of sonars whose picture is not a fan of the last ping.

const outside = new Uint32Array(new Uint8Array([13, 17, 23, 255]).buffer)[0];

export function drawFlat(canvas, image, map, gain) {
  if (canvas.width !== image.width || canvas.height !== image.height) [canvas.width, canvas.height] = [image.width, image.height];
  const g = canvas.getContext('2d');
  const out = g.createImageData(image.width, image.height);
  const pixels = new Uint32Array(out.data.buffer);
  const colours = new Uint32Array(map.slice().buffer);
  const colourOf = Uint32Array.from({ length: 256 }, (_, v) => (v ? colours[Math.min(255, Math.round(v * gain))] : outside));
  for (let i = 0; i < pixels.length; i++) pixels[i] = colourOf[image.data[i]];
  g.putImageData(out, 0, 0);
}
