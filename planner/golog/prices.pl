:- module(planner_prices,
          [ prices/2,                   % +N, -Prices
            priced/7,                   % +Rounds, +Pool, +Jobs, +Seats, +Prices, -Prices, -Result
            affordable/5,               % +Pool, +Jobs, +Seats, +Prices, -Pool
            worth/4                     % +Jobs, +Prices, +Sum, -Sum
          ]).

/** <module> Prices of jobs: an admissible test whether robots can do them all

Each job has a price, and a run is worth the prices of its jobs. If the best runs of all robots together
are worth less than all jobs, the jobs cannot all be done, by whatever runs. Where the test fails, prices
rise for jobs that no best run does, and fall for those that several do: subgradient steps on the
Lagrangian dual of the set cover [Held, Karp 1971], of a length after Polyak 1969. The limit is the bound of
fractional covers. Prices are integers, so that the test is exact.

    Pool   p(I, Used, Must, Monotone, Sets): the runs that are left to the Ith robot, as set(Mask, Jobs), of jobs
           that are still to be given away; Used: it takes part in any case
    Seats  so many of the others can take part
*/

:- use_module(library(lists)).
:- use_module(library(apply)).

:- set_prolog_flag(optimise, true).

%   The mean price.
unit(10_000).

%!  prices(+N, -Prices) is det.
%
%   The same for all of N jobs.

prices(N, Prices) :-
    unit(Unit),
    length(List, N),
    maplist(=(Unit), List),
    compound_name_arguments(Prices, prices, List).

%!  priced(+Rounds, +Pool, +Jobs, +Seats, +Prices0, -Prices, -Result) is det.
%
%   Result is
%     - refuted: not all jobs can be done
%     - done(Takes): the best runs, take(I, Jobs), do all jobs
%     - open: after so many rounds neither is known. Prices are those that come closest to a refutation

priced(Rounds, Pool, Jobs, Seats, Prices0, Prices, Result) :-
    length(Jobs, Size),
    unit(Unit),
    Total is Size * Unit,
    prices_of(Jobs, Prices0, Values),
    rescaled(Jobs, Values, Total, Prices0, Prices1),
    rounds(Rounds, in(Pool, Jobs, Seats, Total), Prices1, 1.0, 0, best(none, Prices1), Prices, Result).

rounds(0, _, _, _, _, best(_, Prices), Prices, open) :- !.
rounds(Left, In, Prices0, Length0, Stalled0, Best0, Prices, Result) :-
    In = in(Pool, Jobs, Seats, Total),
    evaluated(Pool, Jobs, Seats, Prices0, Gap, Tops, _),
    (   Gap > 0
    ->  Prices = Prices0, Result = refuted
    ;   demand(Jobs, Tops, Prices0, Demand, Square, Missing),
        (   Missing =:= 0
        ->  Prices = Prices0,
            findall(take(I, Some), ( member(top(I, _, Some, Counts), Tops), Counts \== out ), Takes),
            Result = done(Takes)
        ;   Best0 = best(Gap0, _),
            (   ( Gap0 == none ; Gap > Gap0 )
            ->  Best = best(Gap, Prices0), Stalled = 0, Length = Length0
            ;   Stalled0 >= 8
            ->  Best = Best0, Stalled = 0, Length is Length0 * 0.7
            ;   Best = Best0, Stalled is Stalled0 + 1, Length = Length0
            ),
            Step is Length * (Total // 100 - Gap) / Square,
            stepped(Jobs, Demand, Step, Prices0, Values),
            rescaled(Jobs, Values, Total, Prices0, Prices1),
            Left1 is Left - 1,
            rounds(Left1, In, Prices1, Length, Stalled, Best, Prices, Result)
        )
    ).

%   Gap: how much more all jobs are worth than the best runs. Tops: top(I, Worth, Jobs, Counts) for each robot of the
%   pool, Counts being used | maybe | out (no seat). Entry: what the seat that is worth least is worth.
evaluated(Pool, Jobs, Seats, Prices, Gap, Tops, Entry) :-
    worth(Jobs, Prices, 0, All),
    tops(Pool, Prices, Tops0, 0, Others),
    (   Others =< Seats
    ->  Tops = Tops0, Entry = 0
    ;   findall(Worth-I, member(top(I, Worth, _, maybe), Tops0), Worths),
        sort(1, @>=, Worths, Sorted),
        length(Seated, Seats),
        append(Seated, _, Sorted),
        last(Seated, Entry-_),
        maplist(seat(Seated), Tops0, Tops)
    ),
    counted(Tops, 0, Sum),
    Gap is All - Sum.

tops([], _, [], Others, Others).
tops([p(I, Used, _, _, Sets)|Pool], Prices, [top(I, Worth, Jobs, Counts)|Tops], Others0, Others) :-
    best(Sets, Prices, [], 0, Jobs, Worth),
    ( Used == true -> Counts = used, Others1 = Others0 ; Counts = maybe, Others1 is Others0 + 1 ),
    tops(Pool, Prices, Tops, Others1, Others).

seat(Seated, top(I, Worth, Jobs, Counts0), top(I, Worth, Jobs, Counts)) :-
    ( Counts0 == maybe, \+ memberchk(_-I, Seated) -> Counts = out ; Counts = Counts0 ).

counted([], Sum, Sum).
counted([top(_, Worth, _, Counts)|Tops], Sum0, Sum) :-
    ( Counts == out -> Sum1 = Sum0 ; Sum1 is Sum0 + Worth ),
    counted(Tops, Sum1, Sum).

best([], _, Jobs, Worth, Jobs, Worth).
best([set(_, Some)|Sets], Prices, Jobs0, Worth0, Jobs, Worth) :-
    worth(Some, Prices, 0, Worth1),
    (   Worth1 > Worth0
    ->  best(Sets, Prices, Some, Worth1, Jobs, Worth)
    ;   best(Sets, Prices, Jobs0, Worth0, Jobs, Worth)
    ).

%!  worth(+Jobs, +Prices, +Sum0, -Sum) is det.

worth([], _, Sum, Sum).
worth([Job|Jobs], Prices, Sum0, Sum) :-
    arg(Job, Prices, Price),
    Sum1 is Sum0 + Price,
    worth(Jobs, Prices, Sum1, Sum).

%   Demand: by job, 1 less the number of best runs that do it; Square: of its length; Missing: how many jobs none does.
%   A job that costs nothing does not get cheaper.
demand(Jobs, Tops, Prices, Demand, Square, Missing) :-
    functor(Prices, _, N),
    functor(Demand, demand, N),
    one_each(Jobs, Demand),
    met(Tops, Demand),
    demanded(Jobs, Demand, Prices, 0, Square, 0, Missing).

one_each([], _).
one_each([Job|Jobs], Demand) :- arg(Job, Demand, 1), one_each(Jobs, Demand).

met([], _).
met([top(_, _, Jobs, Counts)|Tops], Demand) :-
    ( Counts == out -> true ; one_less(Jobs, Demand) ),
    met(Tops, Demand).

one_less([], _).
one_less([Job|Jobs], Demand) :-
    arg(Job, Demand, Many),
    Fewer is Many - 1,
    setarg(Job, Demand, Fewer),
    one_less(Jobs, Demand).

demanded([], _, _, Square, Square, Missing, Missing).
demanded([Job|Jobs], Demand, Prices, Square0, Square, Missing0, Missing) :-
    arg(Job, Demand, Many),
    arg(Job, Prices, Price),
    ( Many < 0, Price =:= 0 -> Square1 = Square0 ; Square1 is Square0 + Many * Many ),
    ( Many > 0 -> Missing1 is Missing0 + 1 ; Missing1 = Missing0 ),
    demanded(Jobs, Demand, Prices, Square1, Square, Missing1, Missing).

prices_of([], _, []).
prices_of([Job|Jobs], Prices, [Price|Values]) :-
    arg(Job, Prices, Price),
    prices_of(Jobs, Prices, Values).

stepped([], _, _, _, []).
stepped([Job|Jobs], Demand, Step, Prices, [Price|Values]) :-
    arg(Job, Prices, Price0),
    arg(Job, Demand, Many),
    Price is max(0, Price0 + truncate(Step * Many)),
    stepped(Jobs, Demand, Step, Prices, Values).

%   The test does not depend on the scale; the length of steps does.
rescaled(Jobs, Values, Total, Prices0, Prices) :-
    functor(Prices0, _, N),
    functor(Prices, prices, N),
    sum_list(Values, Sum),
    (   Sum =:= 0
    ->  Factor = 0.0
    ;   Factor is float(Total) / Sum
    ),
    scaled(Jobs, Values, Factor, Prices).

scaled([], [], _, _).
scaled([Job|Jobs], [Value|Values], Factor, Prices) :-
    Price is truncate(Value * Factor),
    arg(Job, Prices, Price),
    scaled(Jobs, Values, Factor, Prices).

%!  affordable(+Pool, +Jobs, +Seats, +Prices, -Pool) is det.
%
%   Without the runs that cannot be part of any solution: if a robot does one of them, the test at these prices
%   refutes the rest.

affordable(Pool0, Jobs, Seats, Prices, Pool) :-
    evaluated(Pool0, Jobs, Seats, Prices, Gap, Tops, Entry),
    maplist(affordable(Gap, Entry, Prices), Pool0, Tops, Pool).

affordable(Gap, Entry, Prices, Robot0, top(I, Worth, _, Counts), Robot) :-
    Robot0 = p(I, Used, Must, Monotone, Sets0),
    Robot = p(I, Used, Must, Monotone, Sets),
    ( Counts == out -> Least is Entry + Gap ; Least is Worth + Gap ),
    (   Least =< 0
    ->  Sets = Sets0
    ;   worth_it(Sets0, Prices, Least, Sets)
    ).

worth_it([], _, _, []).
worth_it([Set|Sets], Prices, Least, Kept) :-
    Set = set(_, Jobs),
    worth(Jobs, Prices, 0, Worth),
    ( Worth >= Least -> Kept = [Set|Kept1] ; Kept = Kept1 ),
    worth_it(Sets, Prices, Least, Kept1).
