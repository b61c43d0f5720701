import { mount } from "svelte";
import App from "./App.svelte";
import "./app.css";
import { begin } from "./i18n.svelte";
import { begin as beginOutbox } from "./outbox/outbox.svelte";
import { preload } from "./routes";
import { recall } from "./session.svelte";
import { lastGym } from "./shell/lastGym.svelte";

// Opened without a wish, it is where one was last; "Other gyms" leads from there.
if (location.pathname === "/" && lastGym()) history.replaceState(history.state, "", `/g/${lastGym()}`);

const begun = Promise.all([begin(), recall()]);
// The page's own script meanwhile; what goes wrong with it the router tells.
preload(location.pathname as Parameters<typeof preload>[0]).catch(() => undefined);
await begun;
mount(App, { target: document.getElementById("app")! });

// Below `/embed` the page is somebody else's: nothing is kept there.
if (window.top === window) {
  beginOutbox();
  if ("serviceWorker" in navigator) void navigator.serviceWorker.register("/sw.js");
}
