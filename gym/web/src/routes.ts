/** Which page is at which address. The first part of each is also known to `api/pages.py`. */

import { createRouter } from "sv-router";
import Home from "./pages/Home.svelte";
import NotFound from "./pages/NotFound.svelte";

const wall = () => import("./pages/WallPage.svelte");
const past = () => import("./pages/PastPage.svelte");
const embedded = () => import("./pages/Embedded.svelte");
const widget = () => import("./hall/Widget.svelte");

export const { p, navigate, preload, route } = createRouter({
  "/": Home,
  "/sign-in": () => import("./pages/SignIn.svelte"),
  "/sign-up": () => import("./pages/SignUp.svelte"),
  "/new-password": () => import("./pages/NewPassword.svelte"),
  "/invitation": () => import("./pages/Invitation.svelte"),
  "/sign-in/device": () => import("./pages/SignInDevice.svelte"),
  "/me": () => import("./pages/Me.svelte"),
  "/me/profile": () => import("./pages/MyProfile.svelte"),
  "/me/security": () => import("./pages/Security.svelte"),
  "/me/waiting": () => import("./pages/Waiting.svelte"),
  "/me/messages": () => import("./hall/Messages.svelte"),
  "/unsubscribe": () => import("./hall/Unsubscribe.svelte"),
  "/me/data": () => import("./pages/MyData.svelte"),
  "/people/:person": () => import("./pages/PersonPage.svelte"),
  "/new-gym": () => import("./pages/NewGym.svelte"),
  "/g/:gym": () => import("./pages/GymPage.svelte"),
  "/g/:gym/progress": () => import("./pages/Progress.svelte"),
  "/g/:gym/sessions/:visit": () => import("./pages/SessionPage.svelte"),
  "/g/:gym/board": () => import("./pages/Board.svelte"),
  "/g/:gym/feed": () => import("./pages/Feed.svelte"),
  "/g/:gym/competitions": () => import("./competitions/List.svelte"),
  "/g/:gym/competitions/new": () => import("./competitions/Wizard.svelte"),
  "/g/:gym/competitions/:competition": () => import("./competitions/CompetitionPage.svelte"),
  "/g/:gym/competitions/:competition/edit": () => import("./competitions/Wizard.svelte"),
  "/g/:gym/competitions/:competition/entries": () => import("./competitions/StartList.svelte"),
  "/g/:gym/competitions/:competition/order": () => import("./competitions/OrderPage.svelte"),
  "/g/:gym/competitions/:competition/card": () => import("./competitions/Card.svelte"),
  "/g/:gym/competitions/:competition/judge": () => import("./competitions/JudgePage.svelte"),
  "/g/:gym/competitions/:competition/judge/:problem": () => import("./competitions/JudgeProblem.svelte"),
  "/g/:gym/competitions/:competition/appeals": () => import("./competitions/Appeals.svelte"),
  "/g/:gym/competitions/:competition/board": () => import("./competitions/BoardPage.svelte"),
  "/g/:gym/settings": () => import("./pages/GymSettings.svelte"),
  "/g/:gym/settings/hall": () => import("./hall/HallPage.svelte"),
  "/g/:gym/settings/hall/paper": () => import("./hall/Paper.svelte"),
  "/g/:gym/settings/hall/tags": () => import("./hall/Tags.svelte"),
  "/g/:gym/settings/hall/website": () => import("./hall/Website.svelte"),
  "/g/:gym/settings/zones": () => import("./settings/Zones.svelte"),
  "/g/:gym/settings/comments": () => import("./settings/Reports.svelte"),
  "/g/:gym/settings/people": () => import("./settings/People.svelte"),
  "/g/:gym/settings/plan": () => import("./settings/PlanEditor.svelte"),
  "/g/:gym/settings/webhooks": () => import("./settings/Webhooks.svelte"),
  "/g/:gym/settings/log": () => import("./settings/Log.svelte"),
  "/g/:gym/insights": () => import("./insights/Overview.svelte"),
  "/g/:gym/insights/styles": () => import("./insights/Styles.svelte"),
  "/g/:gym/insights/holds": () => import("./insights/Holds.svelte"),
  "/g/:gym/insights/w/:wall": () => import("./insights/HeatMap.svelte"),
  "/g/:gym/insights/w/:wall/resets": () => import("./insights/Resets.svelte"),
  "/g/:gym/w/:wall": wall,
  "/g/:gym/w/:wall/r/:route": wall,
  "/g/:gym/w/:wall/past": past,
  "/g/:gym/w/:wall/past/:scan": past,
  "/g/:gym/w/:wall/versions": () => import("./pages/Versions.svelte"),
  "/g/:gym/s/:scan/edit": () => import("./pages/Editing.svelte"),
  "/g/:gym/s/:scan": () => import("./pages/ScanPage.svelte"),
  "/kiosk/g/:gym": () => import("./hall/Kiosk.svelte"),
  "/r/:code": () => import("./hall/Short.svelte"),
  "/embed/g/:gym/new": widget,
  "/embed/g/:gym/board": widget,
  "/embed/g/:gym/w/:wall": embedded,
  "/embed/g/:gym/w/:wall/r/:route": embedded,
  "*": NotFound,
});

/** A part of the present address; the page that asks has it. */
export function part(name: "gym" | "wall" | "route" | "scan" | "person" | "visit" | "competition" | "problem" | "code"): string {
  return route.params[name] ?? "";
}
