/** A sideways swipe over a card turns to the next one; scrolling does not. */

const FAR_PX = 70;

export function swipes(turn: (by: -1 | 1) => void): (element: HTMLElement) => () => void {
  return (element) => {
    let from: Touch | undefined;
    const began = (event: TouchEvent): void => {
      const onField = (event.target as Element).closest("input, select, textarea");
      from = event.touches.length === 1 && !onField ? event.touches[0] : undefined;
    };
    const ended = (event: TouchEvent): void => {
      const to = event.changedTouches[0];
      if (!from || !to) return;
      const [x, y] = [to.clientX - from.clientX, to.clientY - from.clientY];
      from = undefined;
      if (Math.abs(x) > FAR_PX && Math.abs(x) > 2 * Math.abs(y)) turn(x < 0 ? 1 : -1);
    };
    element.addEventListener("touchstart", began, { passive: true });
    element.addEventListener("touchend", ended, { passive: true });
    return () => {
      element.removeEventListener("touchstart", began);
      element.removeEventListener("touchend", ended);
    };
  };
}
