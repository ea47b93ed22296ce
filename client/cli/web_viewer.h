// The viewer in the browser, started by the command line: a server of one's own behind the page.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "absl/status/status.h"

namespace rilievo {

struct WebViewerOptions {
  std::string file;                    // a .dss or a scan that the page opens; empty: none
  std::string listen = "127.0.0.1:0";  // of the page; port 0 takes a free one
  std::string store;                   // where jobs are kept; empty: until the viewer ends
};

// Starts the service on a free port of loopback and the gateway (client/web/gateway) before it,
// calls `opened` with the address of the page, and lasts until `stop` or the gateway's end; both
// end with this process, however it ends. The gateway is looked for in the folder that RILIEVO_WEB
// names, in ../share/rilievo/web and in ../web from this program. FAILED_PRECONDITION with what to
// do when the page was not built or Node is not there; UNAVAILABLE when the address cannot be had
// or the gateway ends by itself. The service has no limits and asks for no token: whoever reaches
// `listen` may use it, so callers give an address of loopback.
absl::Status ServeWebViewer(const WebViewerOptions& options,
                            const std::function<void(const std::string& url)>& opened,
                            std::stop_token stop);

// Shows the address in a browser, if this is a desktop with xdg-open; says whether it is.
bool OpenInBrowser(const std::string& url);

}  // namespace rilievo
