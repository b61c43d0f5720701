import { mount } from "svelte";
import App from "./App.svelte";
import "./app.css";
import { begin } from "./i18n.svelte";
import { begin as beginOutbox } from "./outbox/outbox.svelte";
import { preload } from "./routes";
import { followReception, recall, signedInElsewhere } from "./session.svelte";
import { pageAfterSignIn } from "./shell/beforeSignIn";
import { lastGym } from "./shell/lastGym.svelte";

// Another server signed the person in and sent the browser here.
if (location.pathname === "/sign-in/done") {
  signedInElsewhere();
  history.replaceState(null, "", pageAfterSignIn());
}
// Without a path the app opens the last visited gym; "Other gyms" leads elsewhere.
if (location.pathname === "/" && lastGym()) history.replaceState(history.state, "", `/g/${lastGym()}`);

const begun = Promise.all([begin(), recall()]);
// Prefetch the page's own script; the router reports failures.
preload(location.pathname as Parameters<typeof preload>[0]).catch(() => undefined);
void begun.then(() => {
  mount(App, { target: document.getElementById("app")! });
  // Pages below `/embed` belong to other sites: nothing is stored there.
  if (window.top !== window) return;
  beginOutbox();
  followReception();
  if ("serviceWorker" in navigator) void navigator.serviceWorker.register("/sw.js");
});
