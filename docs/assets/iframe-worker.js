// Runs the worker of the search in a hidden frame where pages are opened from disk: browsers start
// no worker there. The name is the one by which the theme's offline plugin knows such a script.
"use strict"

if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    #scope
    #ready

    constructor(url) {
      super()
      const frame = document.createElement("iframe")
      frame.hidden = true
      document.body.append(frame)
      this.#scope = frame.contentWindow
      this.#scope.postMessage = data => this.#tell(data)
      this.#scope.importScripts = (...scripts) =>
        scripts.reduce((before, script) => before.then(() => this.#load(script)), Promise.resolve())
      this.#ready = this.#load(url)
    }

    postMessage(data) {
      this.#ready.then(() => this.#scope.dispatchEvent(new MessageEvent("message", { data })))
    }

    terminate() {
      this.#scope.frameElement.remove()
    }

    #tell(data) {
      const event = new MessageEvent("message", { data })
      this.dispatchEvent(event)
      this.onmessage?.(event)
    }

    #load(url) {
      const { document: page } = this.#scope
      return new Promise((done, failed) => {
        const script = page.createElement("script")
        Object.assign(script, { src: url, onload: done, onerror: failed })
        page.head.append(script)
      })
    }
  }
}
