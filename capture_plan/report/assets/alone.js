CapturePlan.start(document.getElementById("viewer"), JSON.parse(document.getElementById("head-data").textContent));
