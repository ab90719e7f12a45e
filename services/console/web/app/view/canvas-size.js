// A canvas as large as the element around it, in the screen's own pixels.

/** More pixels than this for one of the page's cost more than they show. */
const MOST_RATIO = 2.5;

/** Fits `canvas` and `view` ({projection, ratio, em}) to `element`; false when nothing is to be done: setting its size clears a canvas. */
export function fitCanvas(view, canvas, element) {
  const { clientWidth, clientHeight } = element;
  if (clientWidth === 0 || clientHeight === 0) return false;
  const ratio = Math.min(devicePixelRatio || 1, MOST_RATIO);
  const em = parseFloat(getComputedStyle(document.documentElement).fontSize) || 16;
  const { projection } = view;
  if (ratio === view.ratio && em === view.em && clientWidth === projection.width && clientHeight === projection.height) return false;
  canvas.width = Math.round(clientWidth * ratio);
  canvas.height = Math.round(clientHeight * ratio);
  Object.assign(view, { ratio, em });
  projection.resize(clientWidth, clientHeight);
  return true;
}
