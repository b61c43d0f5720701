/**
 * A script of its own, before those of the app: where the page opens on the wall that was seen last, that wall is read
 * while the app is still on its way.
 */

import { lastWall, loadViewer } from "./script";

interface Viewer {
  expect(src: string): void;
}

const last = lastWall(location.pathname);
if (last) {
  window.wallViewer = loadViewer();
  const read = (): void => (customElements.get("wall-topo") as unknown as Viewer).expect(`${last.base}/page/first.glb`);
  window.wallViewer.then(read, () => undefined);
}
