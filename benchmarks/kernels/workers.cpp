#include "kernels/workers.hpp"

#include <algorithm>

namespace meniscus::bench {

Workers::Workers(int threads) {
  for (int k = 1; k < threads; ++k)
    helpers_.emplace_back([this] {
      std::size_t done = 0;
      for (;;) {
        {
          std::unique_lock lock(mutex_);
          begin_.wait(lock, [&] { return stop_ || round_ != done; });
          if (stop_) return;
          done = round_;
        }
        take_pieces();
        const std::lock_guard lock(mutex_);
        if (--busy_ == 0) end_.notify_one();
      }
    });
}

Workers::~Workers() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  begin_.notify_all();
}

void Workers::take_pieces() {
  for (std::size_t begin; (begin = next_.fetch_add(piece_)) < count_;)
    (*work_)(begin, std::min(count_, begin + piece_));
}

void Workers::run(std::size_t count, std::size_t piece,
                  const std::function<void(std::size_t, std::size_t)>& work) {
  {
    const std::lock_guard lock(mutex_);
    next_ = 0;
    count_ = count;
    piece_ = piece;
    work_ = &work;
    busy_ = static_cast<int>(helpers_.size());
    ++round_;
  }
  begin_.notify_all();
  take_pieces();
  std::unique_lock lock(mutex_);
  end_.wait(lock, [&] { return busy_ == 0; });
}

}  // namespace meniscus::bench
