/** The page at each address. `server/pages.py` also knows the first part of each address. */

import { createRouter } from "sv-router";
import Home from "./gyms/Home.svelte";
import { withTexts } from "./i18n.svelte";
import { has, type Feature } from "./lib/features";
import NotFound from "./shell/NotFound.svelte";
import { pageHooks } from "./shell/unloaded.svelte";

const accounts = withTexts("accounts");
const apps = withTexts("apps");
const climbingLog = withTexts("climbingLog");
const competitions = withTexts("competitions");
const competitionSetup = withTexts("competitionSetup");
const hall = withTexts("hall");
const insights = withTexts("insights");
const inspections = withTexts("inspections");
const listening = withTexts("listening");
const lists = withTexts("lists");
const notifications = withTexts("notifications");
const operator = withTexts("operator");
const ofProblems = withTexts("problems");
const resets = withTexts("resets");
const ropes = withTexts("ropes");
const scans = withTexts("scans");
const webhooks = withTexts("webhooks");

const wall = () => import("./walls/WallPage.svelte");
const holds = () => import("./holds/HoldsToCheck.svelte");
const past = () => import("./publishing/PastPage.svelte");
const problems = () => import("./problems/ProblemsPage.svelte").then(ofProblems);
const embedded = () => import("./walls/Embedded.svelte");

/** A page of an optional feature; missing if the feature is off. */
function of<T>(feature: Feature, page: T): T | typeof NotFound {
  return has(feature) ? page : NotFound;
}

const judgeByLink = of("competitions", () => import("./competitions/JudgeByLink.svelte").then(competitions));
const widget = of("hall", () => import("./hall/Widget.svelte").then(hall));

export const { p, navigate, preload, route } = createRouter({
  hooks: pageHooks,
  "/": Home,
  "/sign-in": () => import("./accounts/SignIn.svelte").then(accounts),
  "/sign-up": () => import("./accounts/SignUp.svelte"),
  "/new-password": () => import("./accounts/NewPassword.svelte"),
  "/invitation": () => import("./gyms/Invitation.svelte"),
  "/sign-in/device": () => import("./accounts/SignInDevice.svelte").then(accounts),
  "/me": () => import("./accounts/Me.svelte").then(accounts),
  "/me/profile": () => import("./accounts/MyProfile.svelte"),
  "/me/security": () => import("./accounts/Security.svelte").then(accounts),
  "/me/apps": () => import("./apps/AppsPage.svelte").then(accounts).then(apps),
  "/oauth/authorize": () => import("./apps/Consent.svelte").then(accounts).then(apps),
  "/me/log": () => import("./climbingLog/LogPage.svelte").then(climbingLog),
  "/me/log/import": () => import("./climbingLog/ImportLog.svelte").then(climbingLog),
  "/me/log/year/:year": () => import("./climbingLog/YearPage.svelte").then(climbingLog),
  "/me/waiting": () => import("./outbox/Waiting.svelte").then(ofProblems).then(lists).then(inspections),
  "/me/messages": () => import("./notifications/Messages.svelte").then(notifications),
  "/unsubscribe": () => import("./notifications/Unsubscribe.svelte").then(notifications),
  "/me/data": () => import("./accounts/MyData.svelte").then(accounts),
  "/selftest": () => import("./operating/SelfTest.svelte"),
  "/setup": () => import("./operator/Setup.svelte").then(operator),
  "/operator": () => import("./operator/Health.svelte").then(operator),
  "/operator/jobs": () => import("./operator/Jobs.svelte").then(operator),
  "/operator/storage": () => import("./operator/Storage.svelte").then(operator),
  "/operator/backups": () => import("./operator/Backups.svelte").then(operator),
  "/operator/users": () => import("./operator/Users.svelte").then(operator),
  "/operator/gyms": () => import("./operator/Gyms.svelte").then(operator),
  "/operator/announcements": () => import("./operator/Announcements.svelte").then(operator),
  "/people/:person": () => import("./climbing/PersonPage.svelte"),
  "/new-gym": () => import("./gyms/NewGym.svelte"),
  "/g/:gym": () => import("./gyms/GymPage.svelte"),
  "/g/:gym/progress": () => import("./climbing/Progress.svelte"),
  "/g/:gym/sessions/:visit": () => import("./climbing/SessionPage.svelte"),
  "/g/:gym/board": () => import("./climbing/Board.svelte"),
  "/g/:gym/feed": () => import("./climbing/Feed.svelte"),
  "/g/:gym/competitions": of("competitions", () => import("./competitions/List.svelte").then(competitions)),
  "/g/:gym/competitions/new": of("competitions", () => import("./competitions/Wizard.svelte").then(competitions).then(competitionSetup)),
  "/g/:gym/competitions/:competition": of("competitions", () => import("./competitions/CompetitionPage.svelte").then(competitions)),
  "/g/:gym/competitions/:competition/edit": of("competitions", () => import("./competitions/Wizard.svelte").then(competitions).then(competitionSetup)),
  "/g/:gym/competitions/:competition/entries": of("competitions", () => import("./competitions/StartList.svelte").then(competitions).then(competitionSetup)),
  "/g/:gym/competitions/:competition/order": of("competitions", () => import("./competitions/OrderPage.svelte").then(competitions)),
  "/g/:gym/competitions/:competition/card": of("competitions", () => import("./competitions/Card.svelte").then(competitions)),
  "/g/:gym/competitions/:competition/judge": of("competitions", () => import("./competitions/JudgePage.svelte").then(competitions)),
  "/g/:gym/competitions/:competition/judge/:problem": of("competitions", () => import("./competitions/JudgeProblem.svelte").then(competitions)),
  "/g/:gym/competitions/:competition/appeals": of("competitions", () => import("./competitions/Appeals.svelte").then(competitions)),
  "/g/:gym/competitions/:competition/board": of("competitions", () => import("./competitions/BoardPage.svelte").then(competitions)),
  "/g/:gym/lists": () => import("./lists/ListsPage.svelte").then(lists),
  "/g/:gym/lists/:list": () => import("./lists/ListPage.svelte").then(lists),
  "/g/:gym/settings": () => import("./gyms/GymSettings.svelte"),
  "/g/:gym/settings/hall": of("hall", () => import("./hall/HallPage.svelte").then(hall)),
  "/g/:gym/settings/hall/paper": of("hall", () => import("./hall/Paper.svelte").then(hall)),
  "/g/:gym/settings/hall/tags": of("hall", () => import("./hall/Tags.svelte").then(hall)),
  "/g/:gym/settings/hall/website": of("hall", () => import("./hall/Website.svelte").then(hall)),
  "/g/:gym/settings/zones": () => import("./walls/Zones.svelte"),
  "/g/:gym/settings/comments": () => import("./climbing/Reports.svelte").then(ofProblems),
  "/g/:gym/settings/people": () => import("./gyms/People.svelte"),
  "/g/:gym/settings/plan": () => import("./walls/PlanEditor.svelte"),
  "/g/:gym/settings/webhooks": () => import("./webhooks/Webhooks.svelte").then(webhooks),
  "/g/:gym/settings/log": () => import("./gyms/Log.svelte"),
  "/g/:gym/holds": holds,
  "/g/:gym/w/:wall/holds": holds,
  "/g/:gym/desk": () => import("./resets/Plans.svelte").then(resets),
  "/g/:gym/desk/:plan": () => import("./resets/PlanPage.svelte").then(resets),
  "/g/:gym/desk/:plan/forerun": () => import("./resets/Forerun.svelte").then(resets),
  "/g/:gym/insights": of("insights", () => import("./insights/Overview.svelte").then(insights)),
  "/g/:gym/insights/styles": of("insights", () => import("./insights/Styles.svelte").then(insights)),
  "/g/:gym/insights/holds": of("insights", () => import("./insights/Holds.svelte").then(insights)),
  "/g/:gym/insights/w/:wall": of("insights", () => import("./insights/HeatMap.svelte").then(insights)),
  "/g/:gym/insights/w/:wall/resets": of("insights", () => import("./insights/Resets.svelte").then(insights)),
  "/g/:gym/inspections": of("inspections", () => import("./inspections/InspectionsPage.svelte").then(inspections)),
  "/g/:gym/inspections/plan": of("inspections", () => import("./inspections/PlanPage.svelte").then(inspections)),
  "/g/:gym/inspections/:inspection": of("inspections", () => import("./inspections/InspectionPage.svelte").then(inspections)),
  "/g/:gym/w/:wall": wall,
  "/g/:gym/w/:wall/r/:route": wall,
  "/g/:gym/w/:wall/r/:route/listen": () => import("./listening/ListenPage.svelte").then(listening),
  "/g/:gym/w/:wall/problems": problems,
  "/g/:gym/w/:wall/problems/new": problems,
  "/g/:gym/w/:wall/problems/:problem": problems,
  "/g/:gym/w/:wall/past": past,
  "/g/:gym/w/:wall/past/:scan": past,
  "/g/:gym/w/:wall/routes": () => import("./publishing/EditRoutes.svelte"),
  "/g/:gym/w/:wall/add-routes": () => import("./publishing/AddRoutes.svelte"),
  "/g/:gym/w/:wall/lines": () => import("./ropes/RopeLines.svelte").then(ropes),
  "/g/:gym/w/:wall/versions": () => import("./publishing/Versions.svelte"),
  "/g/:gym/s/:scan/edit": () => import("./editing/Editing.svelte"),
  "/g/:gym/s/:scan": () => import("./scans/ScanPage.svelte").then(scans),
  "/g/:gym/competitions/:competition/judge-links": of("competitions", () => import("./competitions/JudgeLinks.svelte").then(competitions).then(competitionSetup)),
  "/judge": judgeByLink,
  "/judge/:link": judgeByLink,
  "/kiosk/g/:gym": of("hall", () => import("./hall/Kiosk.svelte").then(hall)),
  "/verify/:code": of("inspections", () => import("./inspections/VerifyPage.svelte").then(inspections)),
  "/r/:code": of("hall", () => import("./hall/Short.svelte").then(hall)),
  "/embed/g/:gym/new": widget,
  "/embed/g/:gym/board": widget,
  "/embed/g/:gym/w/:wall": embedded,
  "/embed/g/:gym/w/:wall/r/:route": embedded,
  "*": NotFound,
});

/** A part of the present address; the calling page has it. */
export function part(name: "gym" | "wall" | "route" | "scan" | "person" | "visit" | "competition" | "list" | "problem" | "code" | "plan" | "year" | "inspection" | "link"): string {
  return route.params[name] ?? "";
}
