// A worker that starts the graphics of the browser, which can take seconds, beside the page, and answers with the renderer's name:
// empty if the browser hides it, null without WebGL2.
const gl = new OffscreenCanvas(1, 1).getContext('webgl2');
const info = gl?.getExtension('WEBGL_debug_renderer_info');
postMessage(gl && (info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : ''));
