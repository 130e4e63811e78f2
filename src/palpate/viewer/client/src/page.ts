// The entry of every page. The server says which one it is: of a touched body, or of a solved one that is looked at.

import { shown } from "./shown";
import { touch } from "./touch";

if (document.documentElement.dataset["mode"] === "shown") shown();
else touch();
