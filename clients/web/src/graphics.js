// A worker that starts the graphics of the browser in parallel to the page, because that can take seconds. It answers with the
// renderer's name: empty if the browser hides it, null without WebGL2.
const gl = new OffscreenCanvas(1, 1).getContext('webgl2');
const info = gl?.getExtension('WEBGL_debug_renderer_info');
postMessage(gl && (info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : ''));
