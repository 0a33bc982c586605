# Workers under Nomad:
#   nomad var put gradfarm/join token=@gradfarm.join
#   nomad job run -var coordinator=https://farm.example.org:7781 deploy/nomad/worker.nomad.hcl
variable "coordinator" {
  type = string
}

variable "count" {
  type    = number
  default = 4
}

job "gradfarm-worker" {
  type     = "service"
  # Below whatever serves people.
  priority = 30

  group "worker" {
    count = var.count

    ephemeral_disk {
      size    = 24000
      migrate = false
    }

    task "worker" {
      driver = "docker"
      # Longer than --drain.
      kill_timeout = "60s"

      identity {
        env = false
      }

      config {
        image = "gradfarm-worker:latest"
        args  = ["--threads", "4"]
      }

      template {
        destination = "secrets/join"
        perms       = "0444"
        data        = "{{ with nomadVar \"gradfarm/join\" }}{{ .token }}{{ end }}"
      }

      env {
        GRADFARM_COORDINATOR = var.coordinator
        GRADFARM_JOIN        = "/secrets/join"
        GRADFARM_STATE       = "/alloc/data/state"
        GRADFARM_CACHE       = "/alloc/data/cache"
        GRADFARM_CACHE_SIZE  = "20"
        GRADFARM_POOL        = "nomad"
        GRADFARM_DRAIN       = "45s"
      }

      resources {
        cores  = 4
        memory = 8192
      }
    }
  }
}
