// Without WebGL2: the fan that the daemon has drawn (/SONAR/fan, mono8), coloured here.

const outside = [13, 17, 23, 255];

export function drawFlat(canvas, image, map, gain) {
  canvas.width = image.width;
  canvas.height = image.height;
  const g = canvas.getContext('2d');
  const out = g.createImageData(image.width, image.height);
  for (let i = 0; i < image.data.length; i++) {
    const value = Math.min(255, Math.round(image.data[i] * gain));
    out.data.set(image.data[i] ? map.subarray(4 * value, 4 * value + 4) : outside, 4 * i);
  }
  g.putImageData(out, 0, 0);
}
