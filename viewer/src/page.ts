/** The classic script of a page: the element, and in a worker the jobs that it asks for. */

import "./main";
import "./tiers/worker";
