// A table that is wider than the screen scrolls in a box of its own, which a keyboard has to reach too.
const reach = () => {
  for (const box of document.querySelectorAll(".md-typeset__scrollwrap")) box.tabIndex = 0;
};
new MutationObserver(reach).observe(document.body, { childList: true, subtree: true });
reach();
