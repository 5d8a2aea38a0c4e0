:- module(planner_transition,
          [ trans/4,                    % +Program, +Situation, -Program, -Situation
            final/2,                    % +Program, +Situation
            settle/4,                   % +Program, +Situation, -Program, -Situation
            instances/7,                % +Frame, +Step, +Vars, +Condition, +Inner-Body, +Situation, -Programs
            expansion/4,                % +Id, +Head, +Situation, -Body
            one_step/3,                 % +Head, -Duration, +Situation
            milliseconds/3              % +Duration, -Milliseconds, +Situation
          ]).

/** <module> The meaning of programs: trans/4 and final/2, one clause a construct

After De Giacomo, Lesperance, Levesque, "ConGolog" (2000) [ConGolog], and De Giacomo, Lesperance,
Levesque, Sardina, "IndiGolog" (2009) [IndiGolog]; time and agents after Kelly 2008 [MIndiGolog].
The program terms are listed in planner_syntax.

A primitive action is durative: a transition starts it and leaves `running(Id)`, which is final as soon
as the situation says that it has ended. Time passes between transitions: see planner_search (looking
ahead, to the next natural end) and planner_steps (acting, to what the robots report).
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(assoc)).
:- use_module(kb_rules(facts), [definition/4, duration/3]).
:- use_module(planner_golog(projection)).

%!  trans(+Program, +Situation, -Rest, -Next) is nondet.
%
%   One step of Program in Situation may lead to Next, where Rest remains to be done.

trans([P|Ps], S, [P1|Ps], S1) :-                    % sequence, first part: [ConGolog] 3
    trans(P, S, P1, S1).
trans([P|Ps], S, Rest, S1) :-                       % sequence, the first part being done
    final(P, S),
    trans(Ps, S, Rest, S1).
trans(choice(Frame, Step, Ps), S, P1, S1) :-        % nondeterministic branch: [Golog]
    chosen_branch(Frame, Step, Ps, P, S, S0),
    taken(P, S0, P1, S1).
trans(pick(Frame, Step, V, Class, P), S, picked(Id-X, pick(Frame, Step, V, Class, P), P1), S1) :-
    step_id(Frame, Step, Id),                       % nondeterministic choice of argument, pi: [Golog]
    candidate(Id, Class, X, S, S0),
    copy_term(V-P, X-Bound),
    taken(Bound, S0, P1, S1).
trans(picked(Id, Pick, P), S, picked(Id, Pick, P1), S1) :-
    trans(P, S, P1, S1).
trans(if(C, P, Q), S, P1, S1) :-                    % conditional: [ConGolog] 3
    (   holds(C, S) -> trans(P, S, P1, S1) ; trans(Q, S, P1, S1) ).
trans(while(C, P), S, [P1, while(C, P)], S1) :-     % iteration: [ConGolog] 3
    \+ \+ holds(C, S),
    trans(P, S, P1, S1).
trans(until(P, C), S, [P1, if(C, [], until(P, C))], S1) :- % OWL-S Repeat-Until: the body, then the test
    trans(P, S, P1, S1).
trans(conc(Ps), S, conc(Rest), S1) :-               % concurrency: [ConGolog] 4, true by [MIndiGolog] 4.3
    one_of(Ps, P, Before, After),
    trans(P, S, P1, S1),
    append(Before, [P1|After], Rest).
trans(foreach(F, Step, Vs, C, Inner, P), S, P1, S1) :- % OWL-S For-Each: one concurrent turn an individual
    instances(F, Step, Vs, C, Inner-P, S, Turns),
    trans(conc(Turns), S, P1, S1).
trans(call(Frame, Step, Head0), S, P1, S1) :-       % procedure call, primitive action: [ConGolog] 4
    bound_head(Head0, S, Head),
    step_id(Frame, Step, Id),
    may_begin(Id, Head, Agent, S),
    (   one_step(Head, Duration, S)
    ->  idle(Agent, S),
        milliseconds(Duration, Milliseconds, S),
        in_order(Id, Agent, S, S0),
        start(Id, Head, Agent, Milliseconds, S0, S2),
        now(S, Now),
        End is Now + Milliseconds,
        note(started(Id, Head, Agent, Now, End), S2, S1),
        P1 = running(Id)
    ;   in_order(Id, Agent, S, S3),
        hold_robot(Head, Agent, Id, S3, S0),
        expansion(Id, Head, S0, Body),
        note(begun(Id, Head), S0, S2),
        P1 = scope(Id, Head, Rest),
        trans(Body, S2, Rest, S1)
    ).
trans(scope(Id, Head, P), S, scope(Id, Head, P1), S1) :-
    trans(P, S, P1, S1).
trans(scope(Id, Head, P), S, [], S1) :-             % a composite process ends: its effects hold
    final(P, S),
    close_scope(Id, Head, S, S1).

%   A choice is a decision that is noted, even where the branch taken has nothing to do.
taken(P, S, P1, S1) :- trans(P, S, P1, S1).
taken(P, S, [], S) :- final(P, S).

%!  final(+Program, +Situation) is semidet.
%
%   Program may end in Situation. A choice or pick may not: it is to be taken first.

final([], _).
final([P|Ps], S) :- final(P, S), final(Ps, S).
final(test(C), S) :- once(holds(C, S)).             % a test takes no time: [IndiGolog]
final(picked(_, _, P), S) :- final(P, S).
final(if(C, P, Q), S) :- ( holds(C, S) -> final(P, S) ; final(Q, S) ).
final(while(C, P), S) :- ( \+ holds(C, S) -> true ; final(P, S) ).
final(until(P, C), S) :- final(P, S), once(holds(C, S)).
final(conc(Ps), S) :- all_final(Ps, S).
final(foreach(F, Step, Vs, C, Inner, P), S) :-
    instances(F, Step, Vs, C, Inner-P, S, Turns),
    all_final(Turns, S).
final(call(Frame, Step, Head0), S) :-               % a composite process that has nothing to do
    bound_head(Head0, S, Head),
    \+ one_step(Head, _, S),
    permitted(Head, S),
    step_id(Frame, Step, Id),
    expansion(Id, Head, S, Body),
    final(Body, S).
final(running(Id), S) :- running(S, Runs), \+ memberchk(run(_, _, Id, _), Runs).

all_final([], _).
all_final([P|Ps], S) :- final(P, S), all_final(Ps, S).

%!  settle(+Program, +Situation, -Rest, -Next) is det.
%
%   Takes every transition that needs no time and leaves no choice: what has ended is left behind, and
%   composite processes whose body is done end.

settle([P|Ps], S, Rest, S1) :- !,
    settle(P, S, P1, S0),
    (   P1 == [] -> settle(Ps, S0, Rest, S1)
    ;   Ps == [] -> Rest = P1, S1 = S0              % else every turn of a loop would nest one deeper
    ;   Rest = [P1|Ps], S1 = S0
    ).
settle(conc(Ps), S, Rest, S1) :- !,
    settle_all(Ps, S, Ps1, S1),
    (   Ps1 == [] -> Rest = [] ; Rest = conc(Ps1) ).
settle(picked(Id, Pick, P), S, Rest, S1) :- !,
    settle(P, S, P1, S1),
    (   P1 == [] -> Rest = [] ; Rest = picked(Id, Pick, P1) ).
settle(scope(Id, Head, P), S, Rest, S1) :- !,
    settle(P, S, P1, S0),
    (   done(P1, S0)
    ->  close_scope(Id, Head, S0, S1),
        Rest = []
    ;   Rest = scope(Id, Head, P1),
        S1 = S0
    ).
settle(running(Id), S, Rest, S) :- !,
    (   final(running(Id), S) -> Rest = [] ; Rest = running(Id) ).
settle(call(Frame, Step, Head), S, Rest, S1) :-
    done(call(Frame, Step, Head), S), !,
    step_id(Frame, Step, Id),
    bound_head(Head, S, Bound),
    close_scope(Id, Bound, S, S1),
    Rest = [].
settle(P, S, P, S).

settle_all([], S, [], S).
settle_all([P|Ps], S, Rest, S1) :-
    settle(P, S, P1, S0),
    (   P1 == [] -> Rest = Rest1 ; Rest = [P1|Rest1] ),
    settle_all(Ps, S0, Rest1, S1).

%   Looking ahead, nothing that depends on sensing is asked: a loop that is not begun is not done.
done(P, S) :-
    catch(final(P, S), error(depends_on_sensing(_), _), fail), !.

close_scope(Id, Head, S0, S) :-
    agent_of(Head, Agent, S0),
    release_robot(Agent, Id, S0, S1),
    apply_effects(Head, S1, S2),
    note(ended(Id, Head), S2, S).

%!  expansion(+Id, +Head, +Situation, -Body) is det.
%
%   The body of a composite process, in the frame Id.

expansion(Id, Head, S, Body) :-
    revision(S, Revision),
    (   definition(Revision, Head, Id, Body)
    ->  true
    ;   throw(error(existence_error(process, Head), _))
    ).

%!  one_step(+Head, -Duration, +Situation) is semidet.
%
%   True if Head is one durative step: a primitive action, or, looking ahead, a composite process with
%   a duration model.

one_step(Head, Duration, S) :-
    revision(S, Revision),
    duration(Revision, Head, Duration),
    !,
    (   Duration = fixed(_) -> true ; mode(S, plan(_)) ).

%!  milliseconds(+Duration, -Milliseconds, +Situation) is semidet.
%
%   Fails where there is no way.

milliseconds(fixed(Milliseconds), Milliseconds, _).
milliseconds(travel(Robot, To, More), Milliseconds, S) :-
    place_of(Robot, From, S),
    travel_time(Robot, From, To, Time, S), !,
    Milliseconds is Time + More.

place_of(Robot, Place, S) :-
    (   set_value(locatedAt, Robot, Place, S) -> true ; Place = here ).

%!  instances(+Frame, +Step, +Vars, +Condition, +Turn, +Situation, -Programs) is det.
%
%   The turns of a for-each: one program for every combination of individuals that satisfies the
%   condition, in order of name. Turn is Inner-Body; Inner becomes the frame of the turn.

instances(Frame, Step, Vars, Condition, Inner-Body, S, Programs) :-
    pairs_keys(Vars, Keys),
    findall(Keys, ( holds(Condition, S), members(Vars, S) ), Tuples0),
    sort(Tuples0, Tuples),
    findall(Program,
            ( member(Tuple, Tuples),
              turn_name(Tuple, Tuples, Name),
              atomic_list_concat([Frame, Step, Name], /, Turn),
              copy_term(t(Keys, Inner, Body), t(Tuple, Turn, Program)) ),
            Programs).

members([], _).
members([X-Class|Vars], S) :- member_of(Class, X, S), members(Vars, S).

%   A turn is called by its first individual, where that tells it from the others.
turn_name([X|_], Tuples, X) :-
    findall(x, member([X|_], Tuples), [_]), !.
turn_name(Tuple, _, Name) :-
    atomic_list_concat(Tuple, +, Name).

step_id(Frame, Step, Id) :-
    atomic_list_concat([Frame, /, Step], Id).

one_of([P|Ps], P, [], Ps).
one_of([Q|Ps], P, [Q|Before], After) :- one_of(Ps, P, Before, After).

%   Arguments that stand for the value of a fluent: individuals are looked up, data stay where they are.
bound_head(Head0, S, Head) :-
    (   compound(Head0)
    ->  compound_name_arguments(Head0, Name, Args0),
        maplist(bound_argument(S), Args0, Args),
        compound_name_arguments(Head, Name, Args)
    ;   Head = Head0
    ).

bound_argument(S, fluent(P, X), Value) :-
    fluent_value(P, X, Known, S), atom(Known), !, Value = Known.
bound_argument(_, Argument, Argument).

%   Choices: looking ahead all are tried; acting, the guide says which.

candidate(Id, Class, X, S, S1) :-
    mode(S, Mode),
    (   Mode = act(guide(Choices, _)), get_assoc(Id, Choices, Chosen)
    ->  X = Chosen,
        \+ excluded(Id, X, S)
    ;   Mode = act(_)
    ->  once(( member_of(Class, X, S), \+ excluded(Id, X, S) ))
    ;   member_of(Class, X, S),
        \+ excluded(Id, X, S)
    ),
    note(chose(Id, X), S, S1).

chosen_branch(Frame, Step, Ps, P, S, S1) :-
    step_id(Frame, Step, Id),
    mode(S, Mode),
    (   Mode = act(guide(Choices, _)), get_assoc(Id, Choices, Chosen)
    ->  nth1(Chosen, Ps, P), N = Chosen
    ;   nth1(N, Ps, P)
    ),
    note(chose(Id, N), S, S1).

%   Acting, the steps of a plan begin in the plan's order, robot by robot. What the plan took as one
%   step has steps of its own, of which the plan says nothing.

in_order(Id, Agent, S, S1) :-
    (   mode(S, act(guide(Choices, Order))),
        get_assoc(Agent, Order, Steps),
        memberchk(Id, Steps)
    ->  Steps = [Id|Later],
        put_assoc(Agent, Order, Later, Order1),
        with_mode(S, act(guide(Choices, Order1)), S1)
    ;   S1 = S
    ).
