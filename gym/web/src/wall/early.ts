/**
 * A script of its own, before those of the app: where the page opens on the wall that was seen last, that wall is read
 * while the app is still on its way.
 */

import { lastWall, loadViewer } from "./script";

interface Viewer {
  expect(src: string): void;
}

const last = lastWall();
if (last && `${location.pathname}/`.startsWith(`${last.page}/`)) {
  window.wallViewer = loadViewer();
  const read = (): void => (customElements.get("wall-topo") as unknown as Viewer).expect(last.first);
  window.wallViewer.then(read, () => undefined);
}
